#ifndef ASSERT_H
#define ASSERT_H
void __ESBMC_assert(_Bool, const char *);
#define assert(condition) __ESBMC_assert(condition, #condition)
#endif
