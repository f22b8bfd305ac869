/* sort.cpp - hxtsort.h compared with std::sort, __gnu_parallel::sort, a plain LSD sort and memcpy
 *
 *   g++ -O3 -fopenmp bench/sort.cpp -o bench_sort && ./bench_sort
 *
 * Prints one CSV row for each comparison: medians of alternating runs in this process, ratio =
 * rival_s / ours_s. For all of them the input is copied, and scratch memory allocated and touched,
 * outside the timing. Both sides get the flags of the README; the rivals gain nothing from
 * -march=native (tried).
 */
#define HXTSORT_IMPLEMENTATION
#include "../hxtsort.h"
#include <omp.h>
#include <parallel/algorithm>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

typedef std::vector<hxtsort_pair> pairs;
typedef void (*sorter)(hxtsort_pair *a, size_t n, int threads);

static const size_t LARGE = 10000000;
static std::vector<unsigned char> scratch; /* ours and the LSD sort's */

static uint64_t random_state = 1;
static uint64_t random_u64()
{
    uint64_t x = random_state += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

/* ---- who is timed */
static void ours(hxtsort_pair *a, size_t n, int threads)
{
    hxtsort_options options;
    memset(&options, 0, sizeof options);
    options.num_threads = threads;
    options.scratch = scratch.data();
    options.scratch_bytes = scratch.size();
    if (hxtsort_pairs(a, n, &options) != HXTSORT_OK) abort();
}

static bool less(const hxtsort_pair &a, const hxtsort_pair &b) { return a.key < b.key; }

static void std_sort(hxtsort_pair *a, size_t n, int) { std::sort(a, a + n, less); }

static void gnu_parallel(hxtsort_pair *a, size_t n, int threads)
{
    __gnu_parallel::sort(a, a + n, less,
                         __gnu_parallel::default_parallel_tag((unsigned)threads));
}

/* The textbook: eight passes of 8 bits, all digits counted in one sweep. */
static void lsd8(hxtsort_pair *a, size_t n, int)
{
    static size_t start[8][256];
    hxtsort_pair *b = (hxtsort_pair *)(void *)scratch.data();

    memset(start, 0, sizeof start);
    for (size_t i = 0; i < n; i++)
        for (int d = 0; d < 8; d++) start[d][a[i].key >> 8 * d & 255]++;
    for (int d = 0; d < 8; d++) {
        size_t sum = 0;
        for (int j = 0; j < 256; j++) {
            size_t count = start[d][j];
            start[d][j] = sum;
            sum += count;
        }
        for (size_t i = 0; i < n; i++) b[start[d][a[i].key >> 8 * d & 255]++] = a[i];
        std::swap(a, b);
    }
}

static void copy(hxtsort_pair *a, size_t n, int) { memcpy(scratch.data(), a, n * sizeof *a); }

/* ---- how */
static double median(std::vector<double> v)
{
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

/* Seconds for one sort of a fresh copy of the input; small inputs are sorted many at a time. */
static double once(sorter sort, const pairs &input, pairs &work, int threads)
{
    size_t n = input.size(), copies = work.size() / n;
    for (size_t c = 0; c < copies; c++) memcpy(&work[c * n], input.data(), n * sizeof work[0]);
    double t = omp_get_wtime();
    for (size_t c = 0; c < copies; c++) sort(&work[c * n], n, threads);
    return (omp_get_wtime() - t) / (double)copies;
}

static void row(const char *name, const pairs &input, int threads, const char *rival_name,
                sorter rival, const pairs &rival_input, int rival_threads, int runs)
{
    size_t n = input.size();
    pairs work(n < 200000 ? n * (200000 / n) : n), rival_work(work.size());
    std::vector<double> a, b;

    once(ours, input, work, threads);
    once(rival, rival_input, rival_work, rival_threads);
    for (int r = 0; r < runs; r++) {
        a.push_back(once(ours, input, work, threads));
        b.push_back(once(rival, rival_input, rival_work, rival_threads));
    }
    for (size_t i = 1; i < n; i++)
        if (work[i - 1].key > work[i].key) abort();
    double ours_s = median(a), rival_s = median(b);
    printf("sort,%s,%d,%.9f,%s,%.9f,%.3f\n", name, threads, ours_s, rival_name, rival_s,
           rival_s / ours_s);
    fflush(stdout);
}

/* ---- on what */
static pairs uniform(size_t n, int bits)
{
    pairs a(n);
    for (size_t i = 0; i < n; i++) {
        a[i].key = random_u64() >> (64 - bits);
        a[i].value = i;
    }
    return a;
}

/* Ranks of a Zipf law with exponent 1 over a million keys, scattered by a hash. */
static pairs zipf(size_t n)
{
    const size_t ranks = 1000000;
    std::vector<double> sum(ranks);
    pairs a(n);
    double s = 0;
    for (size_t r = 0; r < ranks; r++) sum[r] = s += 1.0 / (double)(r + 1);
    for (size_t i = 0; i < n; i++) {
        double u = (double)(random_u64() >> 11) / 9007199254740992.0 * s;
        uint64_t rank = (uint64_t)(std::lower_bound(sum.begin(), sum.end(), u) - sum.begin());
        a[i].key = rank * UINT64_C(0x9e3779b97f4a7c15) >> 1;
        a[i].value = i;
    }
    return a;
}

static void no_bad_case(const pairs &reference)
{
    pairs a = reference;
    std::sort(a.begin(), a.end(), less);
    row("sorted-1e7", a, 1, "ours_uniform", ours, reference, 1, 5);
    std::reverse(a.begin(), a.end());
    row("reversed-1e7", a, 1, "ours_uniform", ours, reference, 1, 5);
    for (size_t i = 0; i < a.size(); i++) a[i].key = 42;
    row("equal-1e7", a, 1, "ours_uniform", ours, reference, 1, 5);
    for (size_t i = 0; i < a.size(); i++)
        a[i].key = (random_u64() & 15) * UINT64_C(0x0123456789abcdef);
    row("distinct16-1e7", a, 1, "ours_uniform", ours, reference, 1, 5);
    row("zipf-1e7", zipf(LARGE), 1, "ours_uniform", ours, reference, 1, 5);
}

int main()
{
    size_t bytes = hxtsort_scratch_bytes(sizeof(hxtsort_pair), LARGE, 2);
    scratch.assign(bytes, 1);
    printf("bench,case,threads,ours_s,rival,rival_s,ratio\n");
    pairs input = uniform(LARGE, 63);
    row("pairs63-1e7", input, 1, "memcpy", copy, input, 1, 9);
    row("pairs63-1e7", input, 1, "std_sort", std_sort, input, 1, 5);
    row("pairs63-1e7", input, 1, "lsd8", lsd8, input, 1, 5);
    row("pairs63-1e7", input, 2, "ours_1t", ours, input, 1, 9);
    row("pairs63-1e7", input, 2, "gnu_parallel", gnu_parallel, input, 2, 5);
    row("pairs30-1e7", uniform(LARGE, 30), 1, "memcpy", copy, input, 1, 9);
    row("pairs63-1e3", uniform(1000, 63), 1, "lsd8", lsd8, uniform(1000, 63), 1, 25);
    row("pairs63-1e4", uniform(10000, 63), 1, "lsd8", lsd8, uniform(10000, 63), 1, 25);
    row("pairs63-1e5", uniform(100000, 63), 1, "lsd8", lsd8, uniform(100000, 63), 1, 25);
    no_bad_case(input);
    return 0;
}
