/* test_hilbert.c - hilbert.h against straightforward oracles. */
#define HILBERT_IMPLEMENTATION
#include "../hilbert.h"
#include "check.h"
#include <stdlib.h>

/* The published sum over all keys of a 3D grid, z fastest: s = s*M + key + 1. */
static uint64_t checksum3(hilbert_curve curve, int depth)
{
    uint64_t s = 0;
    uint32_t n = (uint32_t)1 << depth, x, y, z;

    for (x = 0; x < n; x++)
        for (y = 0; y < n; y++)
            for (z = 0; z < n; z++)
                s = s * UINT64_C(6364136223846793005) + hilbert_encode3(curve, depth, x, y, z) + 1;
    return s;
}

static uint64_t checksum2(hilbert_curve curve, int depth)
{
    uint64_t s = 0;
    uint32_t n = (uint32_t)1 << depth, i, j;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            s = s * UINT64_C(6364136223846793005) + hilbert_encode2(curve, depth, i, j) + 1;
    return s;
}

static void published_checksums(void)
{
    CHECK(checksum3(HILBERT_CURVE_HILBERT, 3) == UINT64_C(0x6b649a8fec55cb00));
    CHECK(checksum3(HILBERT_CURVE_HILBERT, 4) == UINT64_C(0x55f9cc15ce815800));
    CHECK(checksum3(HILBERT_CURVE_MOORE, 3) == UINT64_C(0xce9ae43b16536b00));
    CHECK(checksum3(HILBERT_CURVE_MOORE, 4) == UINT64_C(0x2659befae88b5800));
    CHECK(checksum2(HILBERT_CURVE_HILBERT, 3) == UINT64_C(0x958feae6d92ca660));
    CHECK(checksum2(HILBERT_CURVE_HILBERT, 6) == UINT64_C(0xc9f5336d27ee9800));
    CHECK(checksum2(HILBERT_CURVE_MOORE, 3) == UINT64_C(0x7c2f0e34dead6960));
    CHECK(checksum2(HILBERT_CURVE_MOORE, 6) == UINT64_C(0x9e721c3d3bf35800));
}

static void sorts_points(void)
{
    enum { N = 1000 };
    static double xyz[N][3], sorted[N][3];
    static size_t order[N];
    static uint64_t keys[N];
    hilbert_points points;
    size_t i;

    srand(1);
    for (i = 0; i < N; i++) {
        xyz[i][0] = rand() % 100;
        xyz[i][1] = rand() % 100;
        xyz[i][2] = rand() % 100;
    }
    memcpy(sorted, xyz, sizeof xyz);
    memset(&points, 0, sizeof points);
    points.coordinates = sorted;
    points.count = N;
    CHECK(hilbert_sort_points(sorted, &points, NULL, order, NULL) == HILBERT_OK);
    for (i = 0; i < N; i++) CHECK(memcmp(sorted[i], xyz[order[i]], sizeof xyz[0]) == 0);
    CHECK(hilbert_keys(keys, &points, NULL, NULL, NULL) == HILBERT_OK);
    for (i = 1; i < N; i++) CHECK(keys[i - 1] <= keys[i]);
}

int main(void)
{
    published_checksums();
    sorts_points();
    return check_report();
}
