/* check.h - shared by all test programs: CHECK counts, check_report() prints the counts and returns
 * the exit code. */
#ifndef CHECK_H
#define CHECK_H
#include <stdio.h>
#include <time.h>

static long check_passed, check_failed;

/* Counts one check. A failed one is printed with its place (the first 20 only); the program goes
 * on. */
#define CHECK(condition)                                                                           \
    do {                                                                                           \
        if (condition) {                                                                           \
            check_passed++;                                                                        \
        } else {                                                                                   \
            check_failed++;                                                                        \
            if (check_failed <= 20)                                                                \
                printf("%s:%d: failed: %s\n", __FILE__, __LINE__, #condition);                     \
        }                                                                                          \
    } while (0)

/* A clock for the host of small tests that runs a million times too fast: whatever is done in
 * parallel only if it takes long enough is then done in parallel. */
#if defined(__GNUC__)
__attribute__((unused))
#endif
static double check_hasty_clock(void *user)
{
    (void)user;
    return 1e6 * (double)clock() / (double)CLOCKS_PER_SEC;
}

/* The last line of a test program; returns the exit code of main. */
static int check_report(void)
{
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
#endif
