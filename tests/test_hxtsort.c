/* test_hxtsort.c - hxtsort.h against straightforward oracles. */
#define HXTSORT_IMPLEMENTATION
#include "../hxtsort.h"
#include "check.h"
#include <stdlib.h>

static uint64_t random_state = 1;
static uint64_t random_u64(void)
{
    uint64_t x = random_state += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

static void pairs_are_stable(void)
{
    enum { N = 5000 };
    static hxtsort_pair a[N];
    size_t i;

    for (i = 0; i < N; i++) {
        a[i].key = random_u64() % 100;
        a[i].value = i;
    }
    CHECK(hxtsort_pairs(a, N, NULL) == HXTSORT_OK);
    for (i = 1; i < N; i++)
        CHECK(a[i - 1].key < a[i].key || (a[i - 1].key == a[i].key && a[i - 1].value < a[i].value));
}

static void values_follow_keys(void)
{
    enum { N = 5000 };
    static uint64_t keys[N], before[N];
    static uint32_t values[N];
    size_t i;

    for (i = 0; i < N; i++) {
        before[i] = keys[i] = random_u64();
        values[i] = (uint32_t)i;
    }
    CHECK(hxtsort_u64_u32(keys, values, N, NULL) == HXTSORT_OK);
    for (i = 0; i < N; i++) CHECK(keys[i] == before[values[i]]);
    for (i = 1; i < N; i++) CHECK(keys[i - 1] <= keys[i]);
}

int main(void)
{
    pairs_are_stable();
    values_follow_keys();
    return check_report();
}
