/* Functions of the C library that the firmware uses, for the model checker. */
#ifndef MATH_H
#define MATH_H
#define INFINITY __builtin_inff()
#define isinf(x) __builtin_isinf(x)
float sqrtf(float x);

static inline float fminf(float x, float y)
{
    return x < y || y != y ? x : y;
}

static inline float fmaxf(float x, float y)
{
    return x > y || y != y ? x : y;
}

/* Only for values within the range of `long`. */
static inline float ceilf(float x)
{
    float whole = (float)(long)x;

    return whole < x ? whole + 1.0f : whole;
}
#endif
