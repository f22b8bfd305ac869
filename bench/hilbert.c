/* hilbert.c - hilbert.h compared with computing the bounding box of the same points, with a small
 * state machine, and with itself on one thread
 *
 *   gcc -O3 -fopenmp bench/hilbert.c -o bench_hilbert -lm && ./bench_hilbert
 *
 * Prints one CSV row for each comparison: medians of alternating runs in this process, ratio =
 * rival_s / ours_s. All memory has been touched before the timing starts.
 */
#define HILBERT_IMPLEMENTATION
#include "../hilbert.h"
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>

enum { COUNT = 10000000, MOST_RUNS = 25 };

static double *xyz;
static uint64_t *keys, *rival_keys;
static hilbert_box box;
static volatile double sink;

typedef void (*job)(int threads);

static void ours(int threads) { hilbert_keys3(keys, xyz, 0, COUNT, &box, threads); }

static void bbox(int threads)
{
    hilbert_box fitted;
    hilbert_box_fit3(&fitted, xyz, 0, COUNT, threads);
    sink = fitted.lo[0];
}

/* 21 steps through a table of 96 bytes (and 8 for the first step of the closed curve). */
static void lut96(int threads)
{
    double scale[3];
    size_t p;
    int i, l;

    (void)threads;
    for (i = 0; i < 3; i++) scale[i] = 2097152.0 / (box.hi[i] - box.lo[i]) * (1 - 1e-15);
    for (p = 0; p < COUNT; p++) {
        uint32_t x = (uint32_t)(int32_t)((xyz[3 * p] - box.lo[0]) * scale[0]);
        uint32_t y = (uint32_t)(int32_t)((xyz[3 * p + 1] - box.lo[1]) * scale[1]);
        uint32_t z = (uint32_t)(int32_t)((xyz[3 * p + 2] - box.lo[2]) * scale[2]);
        unsigned state = HILBERT__START3;
        uint64_t key = 0;
        for (l = 20; l >= 0; l--) {
            unsigned o = (x >> l & 1) << 2 | (y >> l & 1) << 1 | (z >> l & 1);
            unsigned entry = hilbert__encode_table3[state][o];
            key = key << 3 | (entry & 7);
            state = entry >> 3;
        }
        rival_keys[p] = key;
    }
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double seconds(job j, int threads)
{
    double t = omp_get_wtime();
    j(threads);
    return omp_get_wtime() - t;
}

static void row(int threads, const char *name, job rival, int rival_threads, int runs)
{
    double a[MOST_RUNS], b[MOST_RUNS];
    int r;

    seconds(ours, threads);
    for (r = 0; r < runs; r++) {
        a[r] = seconds(ours, threads);
        b[r] = seconds(rival, rival_threads);
    }
    qsort(a, (size_t)runs, sizeof *a, by_value);
    qsort(b, (size_t)runs, sizeof *b, by_value);
    printf("hilbert,keys-1e7,%d,%.9f,%s,%.9f,%.3f\n", threads, a[runs / 2], name, b[runs / 2],
           b[runs / 2] / a[runs / 2]);
    fflush(stdout);
}

int main(void)
{
    uint64_t state = 1;
    size_t i;

    xyz = (double *)malloc(3 * COUNT * sizeof *xyz);
    keys = (uint64_t *)malloc(COUNT * sizeof *keys);
    rival_keys = (uint64_t *)malloc(COUNT * sizeof *keys);
    if (!xyz || !keys || !rival_keys) return 1;
    for (i = 0; i < 3 * COUNT; i++) {
        uint64_t x = state += UINT64_C(0x9e3779b97f4a7c15);
        x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
        x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
        xyz[i] = (double)(x >> 11) / 9007199254740992.0;
    }
    memset(keys, 1, COUNT * sizeof *keys);
    memset(rival_keys, 1, COUNT * sizeof *keys);
    hilbert_box_fit3(&box, xyz, 0, COUNT, 1);
    printf("bench,case,threads,ours_s,rival,rival_s,ratio\n");
    row(1, "bbox", bbox, 1, 15);
    row(1, "lut96", lut96, 1, 5);
    row(2, "ours_1t", ours, 1, 15);
    return 0;
}
