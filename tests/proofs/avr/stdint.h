/* Integer types of AVR, where `int` has 16 bits. The model checker uses this folder instead of the system's headers. */
#ifndef STDINT_H
#define STDINT_H
typedef signed char int8_t;
typedef unsigned char uint8_t;
typedef int int16_t;
typedef unsigned int uint16_t;
typedef long int32_t;
typedef unsigned long uint32_t;
#define UINT8_MAX 255u
#define UINT16_MAX 65535u
_Static_assert(sizeof(uint16_t) == 2 && sizeof(uint32_t) == 4, "AVR");
#endif
