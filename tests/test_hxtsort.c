/* test_hxtsort.c - hxtsort.h compared with a merge sort, for many key types, sizes, patterns and
 * numbers of threads. */
#define HXTSORT_IMPLEMENTATION
#include "../hxtsort.h"
#include "check.h"
#include <math.h>
#include <stdlib.h>

typedef struct star {
    char   name[13];
    float  brightness;
    double mass;
} star;
#define HXTSORT_NAME   sort_by_brightness
#define HXTSORT_TYPE   star
#define HXTSORT_KEY(s) ((s).brightness)
#define HXTSORT_BITS   hxtsort_bits_f32
#include "../hxtsort.h"
#define HXTSORT_NAME   sort_by_square
#define HXTSORT_TYPE   int
#define HXTSORT_KEY(s) ((uint64_t)((int64_t)(s) * (s)))
#include "../hxtsort.h"

#define MOST 200000

static uint64_t random_state = 1;
static uint64_t random_u64(void)
{
    uint64_t x = random_state += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

/* ---- the oracle: a stable merge sort of indices */
static int key_less(hxtsort_type type, const unsigned char *a, const unsigned char *b)
{
    uint32_t u, v;
    uint64_t p, q;
    float f, g;
    double d, e;

    switch (type) {
    case HXTSORT_U32: memcpy(&u, a, 4); memcpy(&v, b, 4); return u < v;
    case HXTSORT_I32: memcpy(&u, a, 4); memcpy(&v, b, 4); return (int32_t)u < (int32_t)v;
    case HXTSORT_U64: memcpy(&p, a, 8); memcpy(&q, b, 8); return p < q;
    case HXTSORT_I64: memcpy(&p, a, 8); memcpy(&q, b, 8); return (int64_t)p < (int64_t)q;
    case HXTSORT_F32:
        memcpy(&f, a, 4);
        memcpy(&g, b, 4);
        if (f == f && g == g && !(f == 0 && g == 0)) return f < g;
        memcpy(&u, a, 4); /* total order: by sign, then by bits away from zero */
        memcpy(&v, b, 4);
        if (u >> 31 != v >> 31) return u >> 31 > v >> 31;
        return u >> 31 ? u > v : u < v;
    case HXTSORT_F64:
        memcpy(&d, a, 8);
        memcpy(&e, b, 8);
        if (d == d && e == e && !(d == 0 && e == 0)) return d < e;
        memcpy(&p, a, 8);
        memcpy(&q, b, 8);
        if (p >> 63 != q >> 63) return p >> 63 > q >> 63;
        return p >> 63 ? p > q : p < q;
    }
    return 0;
}

static void merge_order(size_t *order, size_t *spare, size_t n, hxtsort_type type,
                        const unsigned char *keys, size_t stride, int descending)
{
    size_t half = n / 2, i = 0, j = half, k = 0;

    if (n < 2) return;
    merge_order(order, spare, half, type, keys, stride, descending);
    merge_order(order + half, spare, n - half, type, keys, stride, descending);
    while (i < half && j < n) {
        const unsigned char *a = keys + order[i] * stride, *b = keys + order[j] * stride;
        int second = descending ? key_less(type, a, b) : key_less(type, b, a);
        spare[k++] = second ? order[j++] : order[i++];
    }
    while (i < half) spare[k++] = order[i++];
    while (j < n) spare[k++] = order[j++];
    memcpy(order, spare, n * sizeof *order);
}

/* ---- inputs */
enum { UNIFORM, SHORT, FEW, EQUAL, SORTED, REVERSED, HOT, HIGH_BITS, EXTREMES, NUM_PATTERNS };

static uint64_t pattern_key(int pattern, size_t i, size_t n)
{
    uint64_t r = random_u64();

    switch (pattern) {
    case SHORT: return r >> 34;
    case FEW: return (r & 15) * UINT64_C(0x0123456789abcdef);
    case EQUAL: return 7;
    case SORTED: return i * 3;
    case REVERSED: return (n - i) * 3;
    case HOT: return r % 100 ? UINT64_C(0x1234567812345678) : r;
    case HIGH_BITS: return r & UINT64_C(0xfff0000000000000);
    case EXTREMES:
        switch (r >> 20 & 7) {
        case 0: return 0;
        case 1: return UINT64_MAX;
        case 2: return (uint64_t)1 << 63;
        case 3: return UINT64_C(0x7ff0000000000000); /* inf */
        case 4: return UINT64_C(0xfff8000000000000); /* -NaN */
        case 5: return UINT64_C(0x7f8000007fc00001); /* in 32 bits: inf, NaN */
        case 6: return UINT64_C(0x8000000080000000); /* -0 */
        default: return r;
        }
    default: return r;
    }
}

static unsigned char keys[MOST * 8], sorted_keys[MOST * 8], values[MOST * 24], sorted[MOST * 24];
static size_t expected[MOST], order[MOST], spare[MOST];

static int is_narrow(hxtsort_type type)
{
    return type == HXTSORT_U32 || type == HXTSORT_I32 || type == HXTSORT_F32;
}

static size_t fill_keys(hxtsort_type type, int pattern, size_t n)
{
    size_t i, bytes = is_narrow(type) ? 4 : 8;

    for (i = 0; i < n; i++) {
        uint64_t k = pattern_key(pattern, i, n);
        uint32_t half = (uint32_t)(pattern == HIGH_BITS ? k >> 32 : k);
        if (pattern == EXTREMES && i & 1) half = (uint32_t)(k >> 32);
        if (bytes == 8) memcpy(keys + 8 * i, &k, 8);
        else memcpy(keys + 4 * i, &half, 4);
    }
    return bytes;
}

static void expect(hxtsort_type type, size_t n, size_t bytes, int descending)
{
    size_t i;

    for (i = 0; i < n; i++) expected[i] = i;
    merge_order(expected, spare, n, type, keys, bytes, descending);
}

/* The array is `before` in the expected order. */
static int arrived(const unsigned char *now, const unsigned char *before, size_t n, size_t bytes)
{
    size_t i;

    for (i = 0; i < n; i++)
        if (memcmp(now + i * bytes, before + expected[i] * bytes, bytes) != 0) return 0;
    return 1;
}

static void sort_one(hxtsort_type type, int pattern, size_t n, const hxtsort_options *options)
{
    static const size_t value_sizes[] = {0, 4, 8, 1, 24};
    size_t bytes = fill_keys(type, pattern, n), v, i;

    expect(type, n, bytes, options->descending);
    for (i = 0; i < n * 24; i++) values[i] = (unsigned char)(random_u64() >> 13);
    for (v = 0; v < sizeof value_sizes / sizeof *value_sizes; v++) {
        memcpy(sorted_keys, keys, n * bytes);
        memcpy(sorted, values, n * 24);
        CHECK(hxtsort_by_type(type, sorted_keys, sorted, value_sizes[v], n, options) == HXTSORT_OK);
        CHECK(arrived(sorted_keys, keys, n, bytes));
        CHECK(arrived(sorted, values, n, value_sizes[v]));
    }
    CHECK(hxtsort_argsort(order, type, keys, 0, n, options) == HXTSORT_OK);
    CHECK(memcmp(order, expected, n * sizeof *order) == 0);
    memcpy(sorted, values, n * 24);
    CHECK(hxtsort_reorder(sorted, 24, order, n, options) == HXTSORT_OK);
    CHECK(arrived(sorted, values, n, 24));
}

/* ---- the tests */
static void every_type_and_pattern(void)
{
    static const size_t sizes[] = {0, 1, 2, 3, 24, 25, 26, 100, 1000, 5003};
    hxtsort_options options;
    int type, pattern, down;
    size_t s;

    memset(&options, 0, sizeof options);
    for (type = HXTSORT_U32; type <= HXTSORT_F64; type++)
        for (pattern = 0; pattern < NUM_PATTERNS; pattern++)
            for (down = 0; down < 2; down++)
                for (s = 0; s < sizeof sizes / sizeof *sizes; s++) {
                    options.descending = down;
                    sort_one((hxtsort_type)type, pattern, sizes[s], &options);
                }
}

/* What templates sort by: numbers in the order of the keys. */
static void bits_sort_like_keys(void)
{
    static const int32_t i32[] = {INT32_MIN, -70000, -1, 0, 1, 70000, INT32_MAX};
    static const int64_t i64[] = {INT64_MIN, -((int64_t)1 << 40), -1, 0, 1, (int64_t)1 << 40,
                                  INT64_MAX};
    static const float f32[] = {-3e38f, -1, -1e-40f, 0, 1e-40f, 1, 3e38f};
    static const double f64[] = {-1e300, -1, -4e-320, 0, 4e-320, 1, 1e300};
    int k;
    for (k = 1; k < 7; k++) {
        CHECK(hxtsort_bits_i32(i32[k - 1]) < hxtsort_bits_i32(i32[k]));
        CHECK(hxtsort_bits_i64(i64[k - 1]) < hxtsort_bits_i64(i64[k]));
        CHECK(hxtsort_bits_f32(f32[k - 1]) < hxtsort_bits_f32(f32[k]));
        CHECK(hxtsort_bits_f64(f64[k - 1]) < hxtsort_bits_f64(f64[k]));
    }
    CHECK(hxtsort_bits_u32(7) == 7 && hxtsort_bits_u64(7) == 7);
    CHECK(hxtsort_bits_f64(-0.0) + 1 == hxtsort_bits_f64(0.0));
}

static void large_arrays(void)
{
    hxtsort_options options;
    int type, pattern;

    memset(&options, 0, sizeof options);
    for (type = HXTSORT_U32; type <= HXTSORT_F64; type++)
        for (pattern = 0; pattern < NUM_PATTERNS; pattern++) {
            if (type != HXTSORT_U64 && pattern % 3 != type % 3) continue;
            options.num_threads = 1 + pattern % 3;
            options.descending = pattern & 1;
            sort_one((hxtsort_type)type, pattern, MOST - (size_t)(100 * pattern), &options);
        }
}

static void pairs_for_every_thread_count(void)
{
    static hxtsort_pair a[MOST], first[MOST];
    static hxtsort_pair32 b[MOST];
    hxtsort_options options;
    int pattern;
    size_t i;

    memset(&options, 0, sizeof options);
    for (pattern = 0; pattern < NUM_PATTERNS; pattern++)
        for (options.num_threads = 1; options.num_threads <= 8; options.num_threads++) {
            int good = 1;
            random_state = (uint64_t)pattern;
            for (i = 0; i < MOST; i++) {
                a[i].key = pattern_key(pattern, i, MOST);
                a[i].value = i;
                b[i].key = (uint32_t)(a[i].key >> 16);
                b[i].value = (uint32_t)i;
            }
            CHECK(hxtsort_pairs(a, MOST, &options) == HXTSORT_OK);
            for (i = 1; i < MOST; i++)
                good &= a[i - 1].key < a[i].key ||
                        (a[i - 1].key == a[i].key && a[i - 1].value < a[i].value);
            CHECK(good);
            if (options.num_threads == 1) memcpy(first, a, sizeof a);
            CHECK(memcmp(first, a, sizeof a) == 0);
            CHECK(hxtsort_pairs32(b, MOST, &options) == HXTSORT_OK);
            for (i = 1; i < MOST; i++)
                good &= b[i - 1].key < b[i].key ||
                        (b[i - 1].key == b[i].key && b[i - 1].value < b[i].value);
            CHECK(good);
        }
}

static void typed_functions(void)
{
    enum { N = 3000 };
    static uint32_t u32[N], v32[N];
    static uint64_t u64[N], v64[N];
    static int32_t i32[N];
    static int64_t i64[N];
    static float f32[N];
    static double f64[N];
    size_t i;
    int good = 1;

    for (i = 0; i < N; i++) {
        uint64_t r = random_u64();
        u32[i] = (uint32_t)r;
        i32[i] = (int32_t)(uint32_t)r;
        u64[i] = r;
        i64[i] = (int64_t)r;
        f32[i] = (float)i64[i];
        f64[i] = (double)i64[i];
    }
    CHECK(hxtsort_u32(u32, N, NULL) == HXTSORT_OK && hxtsort_u64(u64, N, NULL) == HXTSORT_OK);
    CHECK(hxtsort_i32(i32, N, NULL) == HXTSORT_OK && hxtsort_i64(i64, N, NULL) == HXTSORT_OK);
    CHECK(hxtsort_f32(f32, N, NULL) == HXTSORT_OK && hxtsort_f64(f64, N, NULL) == HXTSORT_OK);
    for (i = 1; i < N; i++)
        good &= u32[i - 1] <= u32[i] && i32[i - 1] <= i32[i] && u64[i - 1] <= u64[i] &&
                i64[i - 1] <= i64[i] && f32[i - 1] <= f32[i] && f64[i - 1] <= f64[i];
    CHECK(good);
    for (i = 0; i < N; i++) {
        u32[i] = (uint32_t)(N - i);
        v64[i] = u64[i] = u32[i];
        v32[i] = u32[i] ^ 5;
    }
    CHECK(hxtsort_u32_u32(u32, v32, N, NULL) == HXTSORT_OK);
    for (i = 0; i < N; i++) good &= u32[i] == i + 1 && v32[i] == (u32[i] ^ 5);
    CHECK(hxtsort_u64_u64(u64, v64, N, NULL) == HXTSORT_OK);
    for (i = 0; i < N; i++) good &= u64[i] == i + 1 && v64[i] == u64[i];
    for (i = 0; i < N; i++) u64[i] = N - i;
    CHECK(hxtsort_u64_u32(u64, v32, N, NULL) == HXTSORT_OK);
    for (i = 0; i < N; i++) good &= u64[i] == i + 1 && v32[i] == ((uint32_t)(N - i) ^ 5);
    CHECK(good);
}

static void order_of_zeros_and_nans(void)
{
    double a[7] = {0.0, 1.0, -0.0, -1.0, HUGE_VAL, 0.0, -HUGE_VAL};

    a[5] = NAN;
    if (signbit(a[5])) a[5] = -a[5];
    CHECK(hxtsort_f64(a, 7, NULL) == HXTSORT_OK);
    CHECK(a[0] == -HUGE_VAL && a[1] == -1 && a[4] == 1 && a[5] == HUGE_VAL && a[6] != a[6]);
    CHECK(signbit(a[2]) && !signbit(a[3]));
}

static void records_by_template(void)
{
    enum { N = 20000 };
    static star stars[N];
    static int numbers[N];
    int good = 1;
    size_t i;

    for (i = 0; i < N; i++) {
        stars[i].brightness = (float)(random_u64() % 1000) - 500;
        stars[i].mass = (double)i;
        numbers[i] = (int)(random_u64() % 2001) - 1000;
    }
    CHECK(sort_by_brightness(stars, N, NULL) == HXTSORT_OK);
    for (i = 1; i < N; i++)
        good &= stars[i - 1].brightness < stars[i].brightness ||
                (stars[i - 1].brightness == stars[i].brightness &&
                 stars[i - 1].mass < stars[i].mass);
    CHECK(sort_by_square(numbers, N, NULL) == HXTSORT_OK);
    for (i = 1; i < N; i++) good &= abs(numbers[i - 1]) <= abs(numbers[i]);
    CHECK(good);
}

/* An allocator that fails at one call and keeps count. */
typedef struct failing {
    long calls, fail_at, alive;
} failing;

static void *failing_alloc(void *user, size_t size)
{
    failing *f = (failing *)user;
    if (f->calls++ == f->fail_at) return NULL;
    f->alive++;
    return malloc(size);
}

static void failing_release(void *user, void *memory)
{
    failing *f = (failing *)user;
    if (memory) f->alive--;
    free(memory);
}

static void allocation_failures(void)
{
    static const size_t value_sizes[] = {0, 4, 8, 24};
    hxtsort_options options;
    failing f;
    size_t v, n = 40000, bytes;

    memset(&options, 0, sizeof options);
    options.allocator.alloc = failing_alloc;
    options.allocator.release = failing_release;
    options.allocator.user = &f;
    bytes = fill_keys(HXTSORT_U64, UNIFORM, n);
    expect(HXTSORT_U64, n, bytes, 0);
    for (v = 0; v < 4; v++) {
        memset(&f, 0, sizeof f);
        for (;;) {
            hxtsort_result result;
            memcpy(sorted_keys, keys, n * bytes);
            memcpy(sorted, values, n * 24);
            f.calls = 0;
            result = hxtsort_by_type(HXTSORT_U64, sorted_keys, sorted, value_sizes[v], n, &options);
            CHECK(f.alive == 0);
            if (result == HXTSORT_OK) break;
            CHECK(result == HXTSORT_ERROR_OUT_OF_MEMORY);
            CHECK(memcmp(sorted_keys, keys, n * bytes) == 0);
            CHECK(memcmp(sorted, values, n * value_sizes[v]) == 0);
            f.fail_at++;
        }
        CHECK(f.fail_at > 0);
        CHECK(arrived(sorted_keys, keys, n, bytes));
    }
}

static void scratch_of_the_caller(void)
{
    static const size_t value_sizes[] = {0, 4, 8, 1, 24};
    hxtsort_options options;
    size_t v, n, bytes, need;
    failing f;

    memset(&options, 0, sizeof options);
    memset(&f, 0, sizeof f);
    f.fail_at = 0; /* nothing may be allocated */
    options.allocator.alloc = failing_alloc;
    options.allocator.release = failing_release;
    options.allocator.user = &f;
    options.num_threads = 3;
    for (n = 25; n <= MOST; n = n < 150 ? n + 1 : 10 * n)
        for (v = 0; v < 5; v++) {
            unsigned char *memory;
            bytes = fill_keys(HXTSORT_F64, UNIFORM, n);
            expect(HXTSORT_F64, n, bytes, 0);
            memcpy(sorted_keys, keys, n * bytes);
            memcpy(sorted, values, n * 24);
            need = hxtsort_scratch_bytes(8 + value_sizes[v], n, options.num_threads);
            memory = (unsigned char *)malloc(need + 1);
            options.scratch = memory + 1;
            options.scratch_bytes = need;
            CHECK(hxtsort_by_type(HXTSORT_F64, sorted_keys, sorted, value_sizes[v], n, &options) ==
                  HXTSORT_OK);
            CHECK(arrived(sorted_keys, keys, n, bytes));
            CHECK(arrived(sorted, values, n, value_sizes[v]));
            CHECK(hxtsort_argsort(order, HXTSORT_F64, keys, 0, n, &options) == HXTSORT_OK);
            CHECK(memcmp(order, expected, n * sizeof *order) == 0);
            options.scratch_bytes = 100;
            CHECK(hxtsort_by_type(HXTSORT_F64, sorted_keys, sorted, value_sizes[v], n, &options) ==
                  HXTSORT_ERROR_SCRATCH_TOO_SMALL);
            CHECK(arrived(sorted_keys, keys, n, bytes));
            free(memory);
        }
    CHECK(f.calls == 0);
    CHECK(hxtsort_scratch_bytes(16, SIZE_MAX / 2, 1) == 0);
}

/* What is said to be enough is, for more threads than the machine has. */
static void scratch_is_enough_for_many_threads(void)
{
    enum { COUNT = 300000 };
    uint64_t *k = (uint64_t *)malloc(COUNT * sizeof *k);
    uint32_t *v = (uint32_t *)malloc(COUNT * sizeof *v);
    hxtsort_options options;
    size_t i;
    int threads;

    memset(&options, 0, sizeof options);
    for (threads = 1; threads <= 9; threads++) {
        int sorted_pairs = 1;
        for (i = 0; i < COUNT; i++) {
            k[i] = i * 0x9e3779b97f4a7c15u;
            v[i] = (uint32_t)i;
        }
        options.num_threads = threads;
        options.scratch_bytes = hxtsort_scratch_bytes(sizeof *k + sizeof *v, COUNT, threads);
        options.scratch = malloc(options.scratch_bytes);
        CHECK(hxtsort_u64_u32(k, v, COUNT, &options) == HXTSORT_OK);
        for (i = 0; i < COUNT; i++)
            sorted_pairs &= k[i] == v[i] * (uint64_t)0x9e3779b97f4a7c15u && (!i || k[i - 1] < k[i]);
        CHECK(sorted_pairs);
        free(options.scratch);
    }
    free(k);
    free(v);
}

/* More than the caches hold, in memory that is and that is not aligned: written past them. */
static void larger_than_the_caches(void)
{
    const size_t n = 4400000;
    unsigned char *memory = (unsigned char *)malloc(n * sizeof(hxtsort_pair) + 8);
    hxtsort_options options;
    size_t i;
    int shift;

    memset(&options, 0, sizeof options);
    for (shift = 0; shift <= 8; shift += 8) {
        hxtsort_pair *a = (hxtsort_pair *)(void *)(memory + shift);
        uint64_t sum = 0;
        int good = 1;
        options.num_threads = 1 + shift / 4;
        for (i = 0; i < n; i++) {
            a[i].key = random_u64() >> 36;
            a[i].value = (a[i].key * 3) << 32 | i;
        }
        CHECK(hxtsort_pairs(a, n, &options) == HXTSORT_OK);
        for (i = 0; i < n; i++) {
            if (i > 0) good &= a[i - 1].key < a[i].key || (a[i - 1].key == a[i].key &&
                                                           a[i - 1].value < a[i].value);
            good &= a[i].value >> 32 == a[i].key * 3;
            sum += a[i].value & 0xffffffff;
        }
        CHECK(good && sum == (uint64_t)n * (n - 1) / 2);
    }
    free(memory);
}

/* Made from the inside out: at each level 33 of the 64 places that a sample looks at hold one key
 * above all others, and nowhere else is it. */
static void samples_can_be_fooled(void)
{
    const size_t core = HXTSORT__LEAF_BYTES / sizeof(hxtsort_pair) + 1, levels = 3000;
    const size_t n = core + 33 * levels;
    hxtsort_pair *a = (hxtsort_pair *)malloc(n * sizeof *a);
    hxtsort_pair *b = (hxtsort_pair *)malloc(n * sizeof *b), *swap;
    size_t i, level;
    int good = 1;
    for (i = 0; i < core; i++) a[i].key = random_u64() >> 34;
    for (level = 1; level <= levels; level++) {
        size_t m = core + 33 * level, step = m / HXTSORT__SAMPLE, from = 0, put = 0;
        for (i = 0; i < m; i++)
            if (put < 33 && i == put * step) {
                b[i].key = ((uint64_t)1 << 32) + level;
                put++;
            } else {
                b[i] = a[from++];
            }
        swap = a;
        a = b;
        b = swap;
    }
    for (i = 0; i < n; i++) a[i].value = i;
    memcpy(b, a, n * sizeof *a);
    CHECK(hxtsort_pairs(a, n, NULL) == HXTSORT_OK);
    for (i = 0; i < n; i++) {
        good &= a[i].key == b[a[i].value].key;
        if (i > 0) good &= a[i - 1].key < a[i].key || (a[i - 1].key == a[i].key &&
                                                       a[i - 1].value < a[i].value);
    }
    CHECK(good);
    free(a);
    free(b);
}

static void hints_and_bad_arguments(void)
{
    static hxtsort_pair a[MOST];
    hxtsort_options options;
    uint64_t key = 1;
    int good = 1, bits;
    size_t i;

    memset(&options, 0, sizeof options);
    for (bits = 1; bits <= 64; bits += 9) { /* right, too small, too large: a hint is no more */
        options.significant_bits = bits;
        for (i = 0; i < MOST; i++) {
            a[i].key = random_u64() >> 32;
            a[i].value = i;
        }
        CHECK(hxtsort_pairs(a, MOST, &options) == HXTSORT_OK);
        for (i = 1; i < MOST; i++) good &= a[i - 1].key <= a[i].key;
        CHECK(good);
    }
    options.significant_bits = 65;
    CHECK(hxtsort_u64(&key, 1, &options) == HXTSORT_ERROR_INVALID_ARGUMENT);
    options.significant_bits = 0;
    options.num_threads = -1;
    CHECK(hxtsort_u64(&key, 1, &options) == HXTSORT_ERROR_INVALID_ARGUMENT);
    options.num_threads = 0;
    options.allocator.alloc = failing_alloc;
    CHECK(hxtsort_u64(&key, 1, &options) == HXTSORT_ERROR_INVALID_ARGUMENT);
    CHECK(hxtsort_u64(NULL, 1, NULL) == HXTSORT_ERROR_INVALID_ARGUMENT);
    CHECK(hxtsort_u64(NULL, 0, NULL) == HXTSORT_OK);
    CHECK(hxtsort_u64_u32(&key, NULL, 1, NULL) == HXTSORT_ERROR_INVALID_ARGUMENT);
    CHECK(hxtsort_by_type((hxtsort_type)6, &key, NULL, 0, 1, NULL) ==
          HXTSORT_ERROR_INVALID_ARGUMENT);
    CHECK(hxtsort_u64(&key, SIZE_MAX, NULL) == HXTSORT_ERROR_TOO_LARGE);
    CHECK(strcmp(hxtsort_result_string(HXTSORT_OK), "success") == 0);
}

/* From within somebody else's team: each caller's sort is its own. */
static void callers_in_a_team(void)
{
    enum { CALLERS = 5, N = 3000 };
    uint64_t theirs[CALLERS][N];
    int c, i;
    for (c = 0; c < CALLERS; c++)
        for (i = 0; i < N; i++) theirs[c][i] = random_u64();
#ifdef _OPENMP
#  pragma omp parallel for num_threads(CALLERS) schedule(static, 1)
#endif
    for (c = 0; c < CALLERS; c++) (void)hxtsort_u64(theirs[c], N, NULL);
    for (c = 0; c < CALLERS; c++)
        for (i = 1; i < N; i++) CHECK(theirs[c][i - 1] <= theirs[c][i]);
}

int main(void)
{
    callers_in_a_team();
    every_type_and_pattern();
    bits_sort_like_keys();
    large_arrays();
    pairs_for_every_thread_count();
    typed_functions();
    order_of_zeros_and_nans();
    records_by_template();
    allocation_failures();
    scratch_of_the_caller();
    scratch_is_enough_for_many_threads();
    larger_than_the_caches();
    samples_can_be_fooled();
    hints_and_bad_arguments();
    return check_report();
}
