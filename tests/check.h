/* check.h - what every test program shares: CHECK counts, check_report() prints and gives the exit code. */
#ifndef CHECK_H
#define CHECK_H
#include <stdio.h>

static long check_passed, check_failed;

/* Counts one check; a failed one says where, and the program goes on. */
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

/* The last line of a test program; returns the exit code of main. */
static int check_report(void)
{
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
#endif
