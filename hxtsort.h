/* hxtsort.h - v0.1.0 - stable parallel radix sort of keys, pairs, orders and records
 *
 *   #define HXTSORT_IMPLEMENTATION      in one .c or .cpp file, then
 *   #include "hxtsort.h"                there and anywhere else.
 *
 *   #define HXTSORT_IMPLEMENTATION
 *   #include "hxtsort.h"
 *   int main(void)
 *   {
 *       uint64_t keys[3] = {30, 10, 20};
 *       uint32_t values[3] = {0, 1, 2};
 *       return hxtsort_u64_u32(keys, values, 3, NULL); // 10 20 30 and 1 2 0
 *   }
 *
 *   cc -O3 -fopenmp program.c           (OpenMP is optional: without it, one thread)
 *
 * Your own records, sorted by a field or by anything computed from a record:
 *
 *   typedef struct city { const char *name; float height; } city;
 *   #define HXTSORT_NAME   sort_by_height
 *   #define HXTSORT_TYPE   city
 *   #define HXTSORT_KEY(c) ((c).height)
 *   #define HXTSORT_BITS   hxtsort_bits_f32     (or _u32 _u64 _i32 _i64 _f64; _u64 if not set)
 *   #include "hxtsort.h"                        gives a static sort_by_height(cities, count, NULL)
 *
 * Contents (search for the tag)
 *   >>declarations     keys, pairs, columns, any type and value size, orders, records
 *   >>template         the function for your records
 *   >>implementation   >>memory >>options >>keys >>sizes >>kernels >>instances >>driver >>run
 *                      >>columns >>orders >>public
 *
 * What it does not do
 *   Sort in place: it needs scratch (from the caller or the allocator; hxtsort_scratch_bytes
 *   tells): as large as the data for keys alone and pairs; twice that for keys and values in two
 *   arrays, by the functions that have their types in the name; else up to 32 bytes an element and
 *   a copy of the values or records; and up to 1.1 MB more for each thread. Sort by other keys than
 *   numbers of 32 and 64 bits. Order more than 2^32 - 1 keys of 4 bytes by argsort, or with values
 *   that are not of 4 bytes. A thread needs up to 20 KB of stack, or 50 KB where the keys are very
 *   uneven.
 *
 * Order
 *   Stable, ascending or descending: equal keys keep their order, so the result does not depend on
 *   the number of threads. Floats are in the total order of IEEE 754: -NaN, -inf, ..., -0, +0, ...,
 *   inf, NaN; NaNs are ordered by their bits.
 *
 * How it works  (thesis: C. Marot, Parallel tetrahedral mesh generation, 2020, 3.4)
 *   Memory traffic dominates the cost, so the sort saves passes. One sweep finds the bits in which
 *   the keys differ and counts the highest digit of these bits (its place is guessed from a sample;
 *   if the guess is wrong, a second sweep counts). One pass splits the records by this digit into
 *   256 or 512 buckets that fit the L2 cache. There a bucket is sorted by two passes over as many
 *   high bits as tell its keys apart, log2(n) + 4 of them, and written to its final place, while an
 *   insertion sort orders the keys that those bits did not tell apart. These are four trips through
 *   memory, whatever the key: bits that are constant, or too low to matter, cost nothing. The first
 *   sweep detects sorted and reversed data. Records most of which have the same key are partitioned
 *   in three: smaller, equal, greater. A bucket too large for the cache is split again by all
 *   threads. Where too many keys agree in their high bits for insertion, they are sorted by the
 *   lower bits. No input takes more than O(n * key bits).
 *
 *   1e7 pairs of 16 bytes on a Zen 5 server, November 2026, milliseconds: 85 with 63-bit keys, 79
 *   with 30-bit keys, 50 with two threads; memcpy 16, eight passes of 8 bits 221, std::sort 714.
 *
 * Compile-time switches
 *   HXTSORT_STATIC    off    all functions are static: a private copy (to be defined wherever this
 *                            header is included)
 *
 * Licence: MIT or public domain, at the end of the file.
 * SPDX-License-Identifier: MIT OR Unlicense
 */

/* ---- >>declarations ------------------------------------------------------ */
#ifndef HXTSORT_H
#define HXTSORT_H
#define HXTSORT_VERSION 100 /* 10000*major + 100*minor + patch */

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifndef HXTSORT_API
#  if !defined(HXTSORT_STATIC)
#    define HXTSORT_API extern
#  elif defined(__GNUC__)
#    define HXTSORT_API static __attribute__((unused))
#  else
#    define HXTSORT_API static
#  endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum hxtsort_result {
    HXTSORT_OK                      = 0,
    HXTSORT_ERROR_INVALID_ARGUMENT  = -1, /* -1..-15 mean the same in every header */
    HXTSORT_ERROR_OUT_OF_MEMORY     = -2,
    HXTSORT_CANCELLED               = -3,
    HXTSORT_ERROR_TOO_LARGE         = -4,
    HXTSORT_ERROR_INTERNAL          = -5,
    HXTSORT_ERROR_SCRATCH_TOO_SMALL = -32 /* -32..-47 belong to this header */
} hxtsort_result;

/* Where memory comes from, as in the other headers. All zero: malloc and free. Otherwise both
 * functions must be set; only the thread that calls the library calls them. */
typedef struct hxtsort_allocator {
    void *(*alloc)(void *user, size_t size);
    void (*release)(void *user, void *memory);
    void *user;
} hxtsort_allocator;

/* Zeroed or NULL: all defaults. */
typedef struct hxtsort_options {
    int               num_threads; /* 0 = omp_get_max_threads() at each call; 1 without OpenMP */
    int               descending;  /* nonzero: greatest first; equal keys keep their order     */
    int significant_bits;          /* a hint that unsigned keys are below 2^bits; if it is     */
                                   /* wrong, the sort takes one more sweep; 0 = no hint        */
    hxtsort_allocator allocator;        /* zeros = malloc and free                             */
    void             *scratch;          /* memory to use instead of the allocator's, or NULL   */
    size_t            scratch_bytes;    /* its size: see hxtsort_scratch_bytes                 */
} hxtsort_options;

typedef enum hxtsort_type {
    HXTSORT_U32 = 0,
    HXTSORT_U64 = 1,
    HXTSORT_I32 = 2,
    HXTSORT_I64 = 3,
    HXTSORT_F32 = 4, /* IEEE total order: -NaN < -inf < ... < -0 < +0 < ... < inf < NaN */
    HXTSORT_F64 = 5
} hxtsort_type;

typedef struct hxtsort_pair {
    uint64_t key, value;
} hxtsort_pair;

typedef struct hxtsort_pair32 {
    uint32_t key, value;
} hxtsort_pair32;

HXTSORT_API const char *hxtsort_result_string(hxtsort_result result);

/* The bytes of scratch that are enough for any sort of count elements with num_threads threads; 0
 * if they do not fit a size_t. element_bytes is the size of a key and its value together; that of a
 * record for hxtsort_records, hxtsort_reorder and the template; 16 for hxtsort_argsort. */
HXTSORT_API size_t hxtsort_scratch_bytes(size_t element_bytes, size_t count, int num_threads);

/* Sorts keys alone. On failure they are as before the call. */
HXTSORT_API hxtsort_result hxtsort_u32(uint32_t *keys, size_t count,
                                       const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_u64(uint64_t *keys, size_t count,
                                       const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_i32(int32_t *keys, size_t count, const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_i64(int64_t *keys, size_t count, const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_f32(float *keys, size_t count, const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_f64(double *keys, size_t count, const hxtsort_options *options);

/* Sorts pairs whose key and value lie together: the fastest form. */
HXTSORT_API hxtsort_result hxtsort_pairs(hxtsort_pair *pairs, size_t count,
                                         const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_pairs32(hxtsort_pair32 *pairs, size_t count,
                                           const hxtsort_options *options);

/* Sorts keys in one array with their values in another; both get the order of the keys. */
HXTSORT_API hxtsort_result hxtsort_u32_u32(uint32_t *keys, uint32_t *values, size_t count,
                                           const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_u64_u32(uint64_t *keys, uint32_t *values, size_t count,
                                           const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_u64_u64(uint64_t *keys, uint64_t *values, size_t count,
                                           const hxtsort_options *options);

/* Sorts keys of any type with values of any size (0: no values). */
HXTSORT_API hxtsort_result hxtsort_by_type(hxtsort_type type, void *keys, void *values,
                                           size_t value_bytes, size_t count,
                                           const hxtsort_options *options);

/* The order of keys that stay where they are: order[i] is the index of the i-th smallest.
 *
 *   key_stride  in   bytes from one key to the next; 0 = packed
 */
HXTSORT_API hxtsort_result hxtsort_argsort(size_t *order, hxtsort_type type, const void *keys,
                                           size_t key_stride, size_t count,
                                           const hxtsort_options *options);

/* Puts records into an order: record order[i] comes to place i. order must hold each of 0..count-1
 * once, which is not checked. If record_bytes is 0, nothing is done. */
HXTSORT_API hxtsort_result hxtsort_reorder(void *records, size_t record_bytes, const size_t *order,
                                           size_t count, const hxtsort_options *options);

/* A key as an unsigned number with the same order. */
static inline uint64_t hxtsort_bits_u32(uint32_t key) { return key; }
static inline uint64_t hxtsort_bits_u64(uint64_t key) { return key; }
static inline uint64_t hxtsort_bits_i32(int32_t key) { return (uint32_t)key ^ 0x80000000u; }
static inline uint64_t hxtsort_bits_i64(int64_t key) { return (uint64_t)key ^ (uint64_t)1 << 63; }
static inline uint64_t hxtsort_bits_f32(float key)
{
    uint32_t k;
    memcpy(&k, &key, sizeof k);
    return k >> 31 ? (uint32_t)~k : k | 0x80000000u;
}
static inline uint64_t hxtsort_bits_f64(double key)
{
    uint64_t k;
    memcpy(&k, &key, sizeof k);
    return k >> 63 ? ~k : k | (uint64_t)1 << 63;
}

/* Writes the keys of count records as unsigned numbers (hxtsort_bits_*). Several threads may call
 * it at once. */
typedef void hxtsort_fill(uint64_t *bits, const void *records, size_t count);

/* Sorts records of any size by the keys that fill() reads from them or computes. The functions of
 * the template call this. */
HXTSORT_API hxtsort_result hxtsort_records(void *records, size_t record_bytes, size_t count,
                                           hxtsort_fill *fill, const hxtsort_options *options);

#ifdef __cplusplus
}
#endif
#endif /* HXTSORT_H */

/* ---- >>template  a sort function for your records --------------------------- */
#ifdef HXTSORT_NAME
#  ifndef HXTSORT_BITS
#    define HXTSORT_BITS hxtsort_bits_u64
#  endif
#  define HXTSORT__JOIN_(a, b) a##b
#  define HXTSORT__JOIN(a, b)  HXTSORT__JOIN_(a, b)
static void HXTSORT__JOIN(HXTSORT_NAME, _fill)(uint64_t *bits, const void *records, size_t count)
{
    const HXTSORT_TYPE *r = (const HXTSORT_TYPE *)records;
    size_t i;

    for (i = 0; i < count; i++) bits[i] = HXTSORT_BITS(HXTSORT_KEY(r[i]));
}

static hxtsort_result HXTSORT_NAME(HXTSORT_TYPE *records, size_t count,
                                   const hxtsort_options *options)
{
    return hxtsort_records(records, sizeof *records, count, HXTSORT__JOIN(HXTSORT_NAME, _fill),
                           options);
}
#  undef HXTSORT__JOIN
#  undef HXTSORT__JOIN_
#  undef HXTSORT_NAME
#  undef HXTSORT_TYPE
#  undef HXTSORT_KEY
#  undef HXTSORT_BITS
#endif /* HXTSORT_NAME */

/* ---- >>implementation ---------------------------------------------------- */
#if defined(HXTSORT_IMPLEMENTATION) && !defined(HXTSORT_IMPLEMENTATION_DONE)
#define HXTSORT_IMPLEMENTATION_DONE
#include <stdlib.h>
#include <string.h>
#ifdef _OPENMP
#  include <omp.h>
#  define HXTSORT__PRAGMA(text) _Pragma(#text)
#  define HXTSORT__PARALLEL_FOR(n, how)                                                            \
    HXTSORT__PRAGMA(omp parallel for num_threads(n) schedule(how))
#  define HXTSORT__THREAD() omp_get_thread_num()
#else
#  define HXTSORT__PARALLEL_FOR(n, how)
#  define HXTSORT__THREAD() 0
#endif
#if defined(__GNUC__)
#  define HXTSORT__INLINE static inline __attribute__((always_inline))
#  define HXTSORT__APART __attribute__((noinline))
#else
#  define HXTSORT__INLINE static inline
#  define HXTSORT__APART
#endif
#if defined(__SSE2__)
#  include <emmintrin.h>
#endif

/* ---- >>memory -- */
#if defined(__linux__) && (defined(_DEFAULT_SOURCE) || defined(_GNU_SOURCE))
#  include <sys/mman.h>
#endif

/* malloc that asks for huge pages for large blocks, where the system has them: the first access to
 * a page of 4 KB costs more than sorting its contents. */
static void *hxtsort__malloc(void *user, size_t size)
{
    void *memory = malloc(size);

    (void)user;
#ifdef MADV_HUGEPAGE
    if (memory && size >= (size_t)8 << 20) {
        uintptr_t huge = (uintptr_t)2 << 20;
        uintptr_t from = ((uintptr_t)memory + huge - 1) / huge * huge;
        uintptr_t to = ((uintptr_t)memory + size) / huge * huge;
        (void)madvise((void *)from, (size_t)(to - from), MADV_HUGEPAGE); /* a hint: may fail */
    }
#endif
    return memory;
}

static void hxtsort__free(void *user, void *memory)
{
    (void)user;
    free(memory);
}

/* ---- >>options -- */
enum { HXTSORT__MOST_THREADS = 1024 };

static hxtsort_result hxtsort__resolve(hxtsort_options *out, const hxtsort_options *in)
{
    memset(out, 0, sizeof *out);
    if (in) *out = *in;
    if (out->num_threads < 0 || !out->allocator.alloc != !out->allocator.release ||
        out->significant_bits < 0 || out->significant_bits > 64)
        return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (!out->allocator.alloc) {
        out->allocator.alloc = hxtsort__malloc;
        out->allocator.release = hxtsort__free;
    }
#ifdef _OPENMP
    if (out->num_threads == 0) out->num_threads = omp_get_max_threads();
    if (out->num_threads > HXTSORT__MOST_THREADS) out->num_threads = HXTSORT__MOST_THREADS;
#else
    out->num_threads = 1;
#endif
    return HXTSORT_OK;
}

/* The scratch of a sort: the caller's if there is one, else from the allocator. */
static hxtsort_result hxtsort__get_scratch(void **scratch, const hxtsort_options *opt, size_t size)
{
    if (opt->scratch) {
        *scratch = opt->scratch;
        return size <= opt->scratch_bytes ? HXTSORT_OK : HXTSORT_ERROR_SCRATCH_TOO_SMALL;
    }
    *scratch = opt->allocator.alloc(opt->allocator.user, size ? size : 1);
    return *scratch ? HXTSORT_OK : HXTSORT_ERROR_OUT_OF_MEMORY;
}

static void hxtsort__drop_scratch(void *scratch, const hxtsort_options *opt)
{
    if (scratch && !opt->scratch) opt->allocator.release(opt->allocator.user, scratch);
}

/* ---- >>keys  every type as an unsigned number with the same order -- */
/* The map from the bits of a key to that number: bits ^ always ^ (sign bit ? when_negative : 0). */
typedef struct hxtsort__map {
    uint64_t when_negative, always;
} hxtsort__map;

static size_t hxtsort__key_bytes(hxtsort_type type)
{
    return type == HXTSORT_U32 || type == HXTSORT_I32 || type == HXTSORT_F32 ? 4 : 8;
}

static hxtsort__map hxtsort__make_map(hxtsort_type type, int descending)
{
    uint64_t all = hxtsort__key_bytes(type) == 4 ? UINT32_MAX : UINT64_MAX;
    uint64_t sign = all ^ all >> 1;
    hxtsort__map map = {0, 0};

    if (type != HXTSORT_U32 && type != HXTSORT_U64) map.always = sign;
    if (type == HXTSORT_F32 || type == HXTSORT_F64) map.when_negative = all ^ sign;
    if (descending) map.always ^= all;
    return map;
}

/* The sizes that the loops below are compiled for: constants where these functions are inlined. */
typedef struct hxtsort__kind {
    size_t bytes, key_bytes; /* of a record, and of the key at its start */
    int    mapped;           /* 0: the keys are unsigned and ascending, the map does nothing */
} hxtsort__kind;

HXTSORT__INLINE uint64_t hxtsort__key(hxtsort__kind kind, const unsigned char *record,
                                      hxtsort__map map)
{
    if (kind.key_bytes == 8) {
        uint64_t k;
        memcpy(&k, record, sizeof k);
        return kind.mapped ? k ^ ((0 - (k >> 63)) & map.when_negative) ^ map.always : k;
    } else {
        uint32_t k;
        memcpy(&k, record, sizeof k);
        if (!kind.mapped) return k;
        return k ^ ((0 - (k >> 31)) & (uint32_t)map.when_negative) ^ (uint32_t)map.always;
    }
}

/* Numbers of the highest and the lowest set bit; v must not be 0. */
static int hxtsort__highest(uint64_t v)
{
    int bit = 0, step;

    for (step = 32; step > 0; step >>= 1) {
        if (v >> step == 0) continue;
        v >>= step;
        bit += step;
    }
    return bit;
}

static int hxtsort__lowest(uint64_t v) { return hxtsort__highest(v & (0 - v)); }

static uint64_t hxtsort__low_bits(int bits)
{
    return bits >= 64 ? UINT64_MAX : ((uint64_t)1 << bits) - 1;
}

/* ---- >>sizes  measured on a Zen 5 server core, November 2026 -- */
/* Bits of the digit by which a pass splits a large array. 9 bits write 512 streams, whose current
 * lines all fit L1; with 10 bits the pass itself is a fifth slower, with 11 twice as slow.
 * Collecting lines in a buffer and writing them past the caches (Wassenberg and Sanders 2010) took
 * twice the time of plain stores here, for any number of bits. */
#define HXTSORT__SPLIT_BITS       9
#define HXTSORT__SPLIT_BITS_LEAST 8             /* with fewer, updates of equal counters stall */
#define HXTSORT__BUCKET_BYTES     (256 * 1024)  /* size of a bucket that the split aims at */
#define HXTSORT__LEAF_BYTES       (512 * 1024)  /* sorted in cache, with two buffers as large */
#define HXTSORT__DIGIT_BITS       10            /* digit of a pass in cache */
#define HXTSORT__DIGIT_BITS_MOST  11            /* the same, if it completes the key */
#define HXTSORT__SPARE_BITS       4             /* a leaf sorts by log2(n) + 4 bits: one key in  */
                                                /* 16 shares these; insertion sorts the rest    */
#define HXTSORT__FEW              24            /* so many are sorted fastest by insertion */
#define HXTSORT__SHARE            32768         /* records that are worth a thread */
#define HXTSORT__STREAM_BYTES     (64 << 20)    /* data from this size on bypasses the caches */
#define HXTSORT__SAMPLE           64            /* keys sampled, to find one that dominates */
#define HXTSORT__UNKNOWN          UINT64_MAX    /* for `differ`: not known yet */
#define HXTSORT__MAX_PASSES       3             /* in cache: log2(131072) + 4 bits, 10 a pass */

/* The memory of one thread; two buffers for hxtsort__job.cap records each follow it. */
typedef struct hxtsort__space {
    uint32_t digits[HXTSORT__MAX_PASSES][1 << HXTSORT__DIGIT_BITS_MOST];
    size_t   split[1 << HXTSORT__SPLIT_BITS];
    uint64_t differ;           /* bits in which any key of the thread differs from the first key */
    int      sorted, reversed; /* no key is smaller than the one before it; every key is */
    int      streams;          /* the data is larger than the caches */
} hxtsort__space;

/* ---- >>kernels  the loops of one thread -- */
/* Insertion sort of n records from src to dst, which is either src or does not overlap it. */
HXTSORT__INLINE void hxtsort__insert(hxtsort__kind kind, hxtsort__map map,
                                     const unsigned char *src, unsigned char *dst, size_t n)
{
    const size_t bytes = kind.bytes;
    size_t i, j;

    for (i = 0; i < n; i++) {
        unsigned char record[16];
        uint64_t k = hxtsort__key(kind, src + i * bytes, map);

        memcpy(record, src + i * bytes, bytes);
        for (j = i; j > 0 && hxtsort__key(kind, dst + (j - 1) * bytes, map) > k; j--)
            memcpy(dst + j * bytes, dst + (j - 1) * bytes, bytes);
        memcpy(dst + j * bytes, record, bytes);
    }
}

/* The bits in which n keys differ; 0 also if the keys are sorted. */
HXTSORT__INLINE uint64_t hxtsort__survey(hxtsort__kind kind, hxtsort__map map,
                                         const unsigned char *src, size_t n)
{
    uint64_t first = hxtsort__key(kind, src, map), before = first, differ = 0;
    size_t i = 1;

    while (i < n && hxtsort__key(kind, src + i * kind.bytes, map) >= before)
        before = hxtsort__key(kind, src + i++ * kind.bytes, map);
    if (i == n) return 0;
    for (i = 1; i < n; i++) differ |= hxtsort__key(kind, src + i * kind.bytes, map) ^ first;
    return differ;
}

/* Counts the split digit of the records [from, to), finds the bits in which their keys differ, and
 * detects whether they are in order. */
HXTSORT__INLINE void hxtsort__count(hxtsort__kind kind, hxtsort__map map, const unsigned char *src,
                                    size_t from, size_t to, int shift, uint32_t mask,
                                    hxtsort__space *space)
{
    uint64_t first = hxtsort__key(kind, src, map), before = first, differ = 0;
    size_t i = from;

    memset(space->split, 0, sizeof space->split[0] * ((size_t)mask + 1));
    space->sorted = space->reversed = 1;
    if (from == 0 && to > 0) {
        space->split[(uint32_t)(first >> shift) & mask]++;
        i = 1;
    } else if (from < to) {
        before = hxtsort__key(kind, src + (from - 1) * kind.bytes, map);
    }
    while (i < to && (space->sorted || space->reversed)) {
        size_t end = to - i < 256 ? to : i + 256;
        unsigned down = 0, up = 0;
        for (; i < end; i++) {
            uint64_t k = hxtsort__key(kind, src + i * kind.bytes, map);
            space->split[(uint32_t)(k >> shift) & mask]++;
            differ |= k ^ first;
            down |= k < before;
            up |= k >= before;
            before = k;
        }
        if (down) space->sorted = 0;
        if (up) space->reversed = 0;
    }
    for (; i < to; i++) {
        uint64_t k = hxtsort__key(kind, src + i * kind.bytes, map);
        space->split[(uint32_t)(k >> shift) & mask]++;
        differ |= k ^ first;
    }
    space->differ = differ;
}

/* Moves the records [from, to) to the places that space->split gives their digits. */
HXTSORT__INLINE void hxtsort__split(hxtsort__kind kind, hxtsort__map map, const unsigned char *src,
                                    unsigned char *dst, size_t from, size_t to, int shift,
                                    uint32_t mask, hxtsort__space *space)
{
    size_t i;

    for (i = from; i < to; i++) {
        const unsigned char *record = src + i * kind.bytes;
        uint32_t d = (uint32_t)(hxtsort__key(kind, record, map) >> shift) & mask;
        memcpy(dst + space->split[d]++ * kind.bytes, record, kind.bytes);
    }
}

/* Draws a sample of the keys. Returns the bits in which its keys differ; *dominates tells whether
 * more than half of them are the same key, *frequent. */
HXTSORT__INLINE uint64_t hxtsort__guess(hxtsort__kind kind, hxtsort__map map,
                                        const unsigned char *src, size_t n, uint64_t *frequent,
                                        int *dominates)
{
    uint64_t first = hxtsort__key(kind, src, map), candidate = 0, differ = 0;
    size_t i, step = n / HXTSORT__SAMPLE * kind.bytes;
    int votes = 0, found = 0;

    for (i = 0; i < HXTSORT__SAMPLE; i++) { /* the majority vote of Boyer and Moore */
        uint64_t k = hxtsort__key(kind, src + i * step, map);
        differ |= k ^ first;
        if (votes == 0) candidate = k;
        votes += k == candidate ? 1 : -1;
    }
    for (i = 0; i < HXTSORT__SAMPLE; i++)
        found += hxtsort__key(kind, src + i * step, map) == candidate;
    *frequent = candidate;
    *dominates = found > HXTSORT__SAMPLE / 2;
    return differ;
}

/* Partitions records by a key: the smaller, the equal, then the greater ones, each in their order.
 * end returns where the first two parts end. */
HXTSORT__INLINE void hxtsort__part(hxtsort__kind kind, hxtsort__map map, const unsigned char *src,
                                   unsigned char *dst, size_t n, uint64_t key, size_t end[2])
{
    size_t i, smaller = 0, equal = 0, greater;

    for (i = 0; i < n; i++) {
        uint64_t k = hxtsort__key(kind, src + i * kind.bytes, map);
        smaller += k < key;
        equal += k == key;
    }
    greater = smaller + equal;
    equal = smaller;
    smaller = 0;
    end[0] = equal;
    end[1] = greater;
    for (i = 0; i < n; i++) {
        uint64_t k = hxtsort__key(kind, src + i * kind.bytes, map);
        size_t is_smaller = k < key, is_equal = k == key, is_greater = k > key;
        size_t place = ((0 - is_smaller) & smaller) | ((0 - is_equal) & equal) |
                       ((0 - is_greater) & greater); /* a branch would often be mispredicted */
        smaller += is_smaller;
        equal += is_equal;
        greater += is_greater;
        memcpy(dst + place * kind.bytes, src + i * kind.bytes, kind.bytes);
    }
}

/* One pass in cache: moves n records to the places that start[] gives their digits. */
HXTSORT__INLINE void hxtsort__pass(hxtsort__kind kind, hxtsort__map map, const unsigned char *src,
                                   unsigned char *dst, size_t n, int shift, uint32_t mask,
                                   uint32_t *start)
{
    size_t i;

    for (i = 0; i < n; i++) {
        const unsigned char *record = src + i * kind.bytes;
        uint32_t d = (uint32_t)(hxtsort__key(kind, record, map) >> shift) & mask;
        memcpy(dst + (size_t)start[d]++ * kind.bytes, record, kind.bytes);
    }
}

/* Counts the digits of all passes in one sweep and turns the counts into the places where the
 * digits start. Returns 0 if the highest digit is the same in all keys. */
HXTSORT__INLINE int hxtsort__count_digits(hxtsort__kind kind, hxtsort__map map,
                                          const unsigned char *src, size_t n, int low, int bits,
                                          int passes, hxtsort__space *space)
{
    const uint32_t mask = ((uint32_t)1 << bits) - 1;
    size_t i;
    int p;

    for (p = 0; p < passes; p++) memset(space->digits[p], 0, sizeof(uint32_t) << bits);
    if (passes == 1) {
        for (i = 0; i < n; i++)
            space->digits[0][hxtsort__key(kind, src + i * kind.bytes, map) >> low & mask]++;
    } else {
        for (i = 0; i < n; i++) {
            uint64_t k = hxtsort__key(kind, src + i * kind.bytes, map) >> low;
            space->digits[0][k & mask]++;
            space->digits[1][k >> bits & mask]++;
            for (p = 2; p < passes; p++) space->digits[p][k >> p * bits & mask]++;
        }
    }
    if (space->digits[passes - 1][hxtsort__key(kind, src, map) >> (low + (passes - 1) * bits) &
                                  mask] == n)
        return 0;
    for (p = 0; p < passes; p++) {
        uint32_t sum = 0, d;
        for (d = 0; d <= mask; d++) {
            uint32_t count = space->digits[p][d];
            space->digits[p][d] = sum;
            sum += count;
        }
    }
    return 1;
}

typedef void hxtsort__leaf_function(hxtsort__map map, const unsigned char *src, unsigned char *s1,
                                    unsigned char *s2, unsigned char *dst, size_t n,
                                    uint64_t differ, hxtsort__space *space);

/* Moves n records, which are sorted by the bits from low upwards, from src to dst and sorts them by
 * the bits below, too: by insertion, or by leaf() where many keys agree in the bits from low on. */
HXTSORT__INLINE void hxtsort__finish(hxtsort__kind kind, hxtsort__map map, unsigned char *src,
                                     unsigned char *spare, unsigned char *dst, size_t n, int low,
                                     hxtsort__space *space, hxtsort__leaf_function *leaf)
{
    const size_t bytes = kind.bytes;
    uint64_t before = 0;
    size_t i, j, end;

    for (i = 0; i < n; i++) {
        uint64_t k = hxtsort__key(kind, src + i * bytes, map);

        if (k >= before) {
            memcpy(dst + i * bytes, src + i * bytes, bytes);
            before = k;
            continue;
        }
        for (j = i; j > 0 && i - j <= HXTSORT__FEW; j--) {
            if (hxtsort__key(kind, dst + (j - 1) * bytes, map) <= k) break;
            memcpy(dst + j * bytes, dst + (j - 1) * bytes, bytes);
        }
        if (i - j <= HXTSORT__FEW) {
            memcpy(dst + j * bytes, src + i * bytes, bytes);
            continue;
        }
        for (j = i; j > 0; j--)
            if (hxtsort__key(kind, src + (j - 1) * bytes, map) >> low != k >> low) break;
        for (end = i + 1; end < n; end++)
            if (hxtsort__key(kind, src + end * bytes, map) >> low != k >> low) break;
        leaf(map, src + j * bytes, spare + j * bytes, src + j * bytes, dst + j * bytes, end - j,
             hxtsort__low_bits(low), space);
        before = hxtsort__key(kind, dst + (end - 1) * bytes, map);
        i = end - 1;
    }
}

/* memcpy past the caches, for data that is not read again soon: the lines that it overwrites need
 * not be read first. */
static void hxtsort__stream(unsigned char *dst, const unsigned char *src, size_t bytes)
{
    size_t i = 0;

#if defined(__SSE2__)
    if (bytes >= 16) {
        memcpy(dst, src, 16);
        for (i = 16 - ((uintptr_t)dst & 15); i + 16 <= bytes; i += 16)
            _mm_stream_si128((__m128i *)(void *)(dst + i),
                             _mm_loadu_si128((const __m128i *)(const void *)(src + i)));
        _mm_sfence();
    }
#endif
    memcpy(dst + i, src + i, bytes - i);
}

/* Sorts n records from src to dst in cache: LSD passes over as many high bits as tell nearly all
 * keys apart, then insertion.
 *
 *   s1, s2   room for n records each; src may be s2; dst is neither of them, but may be src unless
 *            src is s2
 *   differ   no two keys differ in other bits; HXTSORT__UNKNOWN: this function finds out
 *
 * The recursion ends, as the keys of a call from hxtsort__finish differ in fewer bits. */
HXTSORT__INLINE void hxtsort__leaf(hxtsort__kind kind, hxtsort__map map, const unsigned char *src,
                                   unsigned char *s1, unsigned char *s2, unsigned char *dst,
                                   size_t n, uint64_t differ, hxtsort__space *space,
                                   hxtsort__leaf_function *leaf)
{
    const size_t bytes = kind.bytes;
    const unsigned char *at = src;
    unsigned char *to = s1;
    int high, low, wanted, passes, bits, p, surveyed = 0;

    if (n <= HXTSORT__FEW) {
        hxtsort__insert(kind, map, src, dst, n);
        return;
    }
    if (differ == HXTSORT__UNKNOWN) differ = hxtsort__survey(kind, map, src, n);
    for (;;) {
        if (differ == 0) {
            if (src != dst) memcpy(dst, src, n * bytes);
            return;
        }
        high = hxtsort__highest(differ) + 1;
        low = hxtsort__lowest(differ);
        wanted = hxtsort__highest(n) + HXTSORT__SPARE_BITS;
        if (wanted > high - low) wanted = high - low;
        passes = (wanted + HXTSORT__DIGIT_BITS - 1) / HXTSORT__DIGIT_BITS;
        if (high - low <= passes * HXTSORT__DIGIT_BITS_MOST) wanted = high - low;
        bits = (wanted + passes - 1) / passes;
        low = high > bits * passes ? high - bits * passes : 0;
        if (hxtsort__count_digits(kind, map, src, n, low, bits, passes, space)) break;
        if (surveyed++) return; /* not reached: after a survey the highest digit differs */
        differ = hxtsort__survey(kind, map, src, n);
    }
    for (p = 0; p < passes; p++) {
        hxtsort__pass(kind, map, at, to, n, low + p * bits, ((uint32_t)1 << bits) - 1,
                      space->digits[p]);
        at = to;
        to = to == s1 ? s2 : s1;
    }
    if ((differ & hxtsort__low_bits(low)) == 0) {
        if (space->streams) hxtsort__stream(dst, at, n * bytes);
        else memcpy(dst, at, n * bytes);
    } else {
        hxtsort__finish(kind, map, to == s1 ? s2 : s1, to, dst, n, low, space, leaf);
    }
}

/* ---- >>instances  the kernels for every size of record -- */
typedef struct hxtsort__kernels {
    size_t bytes;
    void (*count)(hxtsort__map map, const unsigned char *src, size_t from, size_t to, int shift,
                  uint32_t mask, hxtsort__space *space);
    void (*split)(hxtsort__map map, const unsigned char *src, unsigned char *dst, size_t from,
                  size_t to, int shift, uint32_t mask, hxtsort__space *space);
    uint64_t (*guess)(hxtsort__map map, const unsigned char *src, size_t n, uint64_t *frequent,
                      int *dominates);
    void (*part)(hxtsort__map map, const unsigned char *src, unsigned char *dst, size_t n,
                 uint64_t key, size_t end[2]);
    hxtsort__leaf_function *leaf;
} hxtsort__kernels;

#  define HXTSORT__INSTANCE(name, bytes_, key_bytes_, mapped_)                                     \
    static const hxtsort__kind hxtsort__kind_##name = {bytes_, key_bytes_, mapped_};               \
    static void hxtsort__count_##name(hxtsort__map map, const unsigned char *src, size_t from,     \
                                      size_t to, int shift, uint32_t mask, hxtsort__space *space)  \
    {                                                                                              \
      hxtsort__count(hxtsort__kind_##name, map, src, from, to, shift, mask, space);                \
    }                                                                                              \
    static void hxtsort__split_##name(hxtsort__map map, const unsigned char *src,                  \
                                      unsigned char *dst, size_t from, size_t to, int shift,       \
                                      uint32_t mask, hxtsort__space *space)                        \
    {                                                                                              \
      hxtsort__split(hxtsort__kind_##name, map, src, dst, from, to, shift, mask, space);           \
    }                                                                                              \
    static uint64_t hxtsort__guess_##name(hxtsort__map map, const unsigned char *src, size_t n,    \
                                          uint64_t *frequent, int *dominates)                      \
    {                                                                                              \
      return hxtsort__guess(hxtsort__kind_##name, map, src, n, frequent, dominates);               \
    }                                                                                              \
    static void hxtsort__part_##name(hxtsort__map map, const unsigned char *src,                   \
                                     unsigned char *dst, size_t n, uint64_t key, size_t end[2])    \
    {                                                                                              \
      hxtsort__part(hxtsort__kind_##name, map, src, dst, n, key, end);                             \
    }                                                                                              \
    static void hxtsort__leaf_##name(hxtsort__map map, const unsigned char *src,                   \
                                     unsigned char *s1, unsigned char *s2, unsigned char *dst,     \
                                     size_t n, uint64_t differ, hxtsort__space *space)             \
    {                                                                                              \
      hxtsort__leaf(hxtsort__kind_##name, map, src, s1, s2, dst, n, differ, space,                 \
                    hxtsort__leaf_##name);                                                         \
    }                                                                                              \
    static void hxtsort__use_##name(hxtsort__kernels *k)                                           \
    {                                                                                              \
      k->bytes = bytes_;                                                                           \
      k->count = hxtsort__count_##name;                                                            \
      k->split = hxtsort__split_##name;                                                            \
      k->guess = hxtsort__guess_##name;                                                            \
      k->part = hxtsort__part_##name;                                                              \
      k->leaf = hxtsort__leaf_##name;                                                              \
    }

HXTSORT__INSTANCE(u4, 4, 4, 0)   /* unsigned keys alone */
HXTSORT__INSTANCE(u8, 8, 8, 0)
HXTSORT__INSTANCE(u4_4, 8, 4, 0) /* unsigned keys with values */
HXTSORT__INSTANCE(u8_4, 12, 8, 0)
HXTSORT__INSTANCE(u8_8, 16, 8, 0)
HXTSORT__INSTANCE(m4, 4, 4, 1)   /* the same for keys that need the map */
HXTSORT__INSTANCE(m8, 8, 8, 1)
HXTSORT__INSTANCE(m4_4, 8, 4, 1)
HXTSORT__INSTANCE(m8_4, 12, 8, 1)
HXTSORT__INSTANCE(m8_8, 16, 8, 1)
#undef HXTSORT__INSTANCE

/* The kernels for records of these sizes: keys of 4 bytes with values of 0 or 4, keys of 8 bytes
 * with values of 0, 4 or 8. They are filled in at every call, since a static table of functions is
 * writable data in some programs. */
static hxtsort__kernels hxtsort__choose(size_t key_bytes, size_t value_bytes, hxtsort__map map)
{
    int mapped = map.always != 0 || map.when_negative != 0;
    hxtsort__kernels k;

    if (key_bytes == 4 && value_bytes == 0) (mapped ? hxtsort__use_m4 : hxtsort__use_u4)(&k);
    else if (key_bytes == 4) (mapped ? hxtsort__use_m4_4 : hxtsort__use_u4_4)(&k);
    else if (value_bytes == 0) (mapped ? hxtsort__use_m8 : hxtsort__use_u8)(&k);
    else if (value_bytes == 4) (mapped ? hxtsort__use_m8_4 : hxtsort__use_u8_4)(&k);
    else (mapped ? hxtsort__use_m8_8 : hxtsort__use_u8_8)(&k);
    return k;
}

/* ---- >>driver  splits the data, hands out the buckets -- */
typedef struct hxtsort__job {
    hxtsort__kernels k;
    hxtsort__map     map;
    int              num_threads;
    size_t           cap;         /* records that each of a thread's two buffers has room for */
    unsigned char   *spaces;      /* num_threads times space_bytes */
    size_t           space_bytes; /* a hxtsort__space and its buffers */
} hxtsort__job;

static hxtsort__space *hxtsort__space_of(const hxtsort__job *job, int thread)
{
    return (hxtsort__space *)(void *)(job->spaces + (size_t)thread * job->space_bytes);
}

/* First record of thread t when n records are dealt out to num_threads. */
static size_t hxtsort__share(size_t n, int t, int num_threads)
{
    size_t each = n / (size_t)num_threads, rest = n % (size_t)num_threads;
    return each * (size_t)t + ((size_t)t < rest ? (size_t)t : rest);
}

/* Sorts n records with the buffers of a thread. thread is the number in the job's own team: 0
 * outside of its parallel regions, whatever team the caller belongs to. */
static void hxtsort__sort_leaf(const hxtsort__job *job, const unsigned char *src,
                               unsigned char *dst, size_t n, uint64_t differ, int thread)
{
    hxtsort__space *space = hxtsort__space_of(job, thread);
    unsigned char *s1 = (unsigned char *)(space + 1);

    job->k.leaf(job->map, src, s1, s1 + job->cap * job->k.bytes, dst, n, differ, space);
}

static void hxtsort__reverse(const hxtsort__job *job, const unsigned char *src, unsigned char *dst,
                             size_t n)
{
    const size_t bytes = job->k.bytes;
    size_t i;

    if (src != dst) {
        for (i = 0; i < n; i++) memcpy(dst + i * bytes, src + (n - 1 - i) * bytes, bytes);
        return;
    }
    for (i = 0; i < n / 2; i++) {
        unsigned char record[16], *a = dst + i * bytes, *b = dst + (n - 1 - i) * bytes;
        memcpy(record, a, bytes);
        memcpy(a, b, bytes);
        memcpy(b, record, bytes);
    }
}

/* The shift that makes a digit of the highest `bits` bits from the highest bit of differ down. */
static int hxtsort__split_shift(uint64_t differ, int bits)
{
    int high = differ ? hxtsort__highest(differ) + 1 : 0;
    return high > bits ? high - bits : 0;
}

/* Counts the digits at *shift in every thread's share; returns the bits in which keys differ. The
 * shift follows from a guess of these bits, so that one sweep can both find them and count; a wrong
 * guess costs a second sweep. Each thread writes only its own space; src is only read. */
static uint64_t hxtsort__count_all(const hxtsort__job *job, const unsigned char *src, size_t n,
                                   uint64_t guess, int bits, int *shift, int *sorted, int *reversed)
{
    const int threads = job->num_threads;
    const uint32_t mask = ((uint32_t)1 << bits) - 1;
    uint64_t differ = 0;
    int t, tries;

    *shift = hxtsort__split_shift(guess, bits);
    for (tries = 0; tries < 2; tries++) {
        int s = *shift;
        HXTSORT__PARALLEL_FOR(threads, static)
        for (t = 0; t < threads; t++)
            job->k.count(job->map, src, hxtsort__share(n, t, threads),
                          hxtsort__share(n, t + 1, threads), s, mask, hxtsort__space_of(job, t));
        differ = 0;
        *sorted = *reversed = 1;
        for (t = 0; t < threads; t++) {
            const hxtsort__space *space = hxtsort__space_of(job, t);
            differ |= space->differ;
            *sorted &= space->sorted;
            *reversed &= space->reversed;
        }
        *shift = hxtsort__split_shift(differ, bits);
        if (*shift == s || *sorted || *reversed) break;
    }
    return differ;
}

static void hxtsort__sort(const hxtsort__job *job, unsigned char *src, unsigned char *other,
                          unsigned char *dst, size_t n, uint64_t promised, int by_digits);
static HXTSORT__APART void hxtsort__sort_by_digit(const hxtsort__job *job, unsigned char *src,
                                                  unsigned char *other, unsigned char *dst,
                                                  size_t n, uint64_t guess);

/* Sorts records of which a sample says that most have the same key: partitioning puts these in
 * their final order, and only the smaller and the greater ones remain to be sorted. Where the equal
 * ones turn out to be few, as in an input made to fool the sample, the others are split by digits
 * next: so each level takes off a quarter of the records, or some bits. */
static void hxtsort__sort_dominated(const hxtsort__job *job, unsigned char *src,
                                    unsigned char *other, unsigned char *dst, size_t n,
                                    uint64_t key)
{
    const size_t bytes = job->k.bytes;
    unsigned char *to = dst == src ? other : dst, *rest = to == src ? other : src;
    size_t end[2], at;
    int fooled;

    job->k.part(job->map, src, to, n, key, end);
    at = end[1] * bytes;
    fooled = end[1] - end[0] < n / 4;
    if (end[0] != 0) hxtsort__sort(job, to, rest, dst, end[0], 0, fooled);
    if (end[1] != n) hxtsort__sort(job, to + at, rest + at, dst + at, n - end[1], 0, fooled);
    if (to != dst)
        memcpy(dst + end[0] * bytes, to + end[0] * bytes, (end[1] - end[0]) * bytes);
}

/* Turns the counts of each thread into its first place in every bucket, and finds the starts of the
 * buckets. Within a bucket the places are in the order of the threads: so the sort is stable. */
static void hxtsort__place(const hxtsort__job *job, size_t *start, int num_buckets)
{
    size_t sum = 0;
    int b, t;

    for (b = 0; b < num_buckets; b++) {
        start[b] = sum;
        for (t = 0; t < job->num_threads; t++) {
            hxtsort__space *space = hxtsort__space_of(job, t);
            size_t count = space->split[b];
            space->split[b] = sum;
            sum += count;
        }
    }
    start[num_buckets] = sum;
}

/* Sorts n records from src to dst, which is src or other; other has room for n records. One pass
 * splits them by the highest bits in which they differ. Then one thread sorts each bucket in cache,
 * or all threads split it again if it is too large for that. The sort is stable, so the result does
 * not depend on the number of threads. promised: if not 0, the bits in which keys may differ.
 * by_digits: do not ask a sample for a key that most records have. */
static void hxtsort__sort(const hxtsort__job *job, unsigned char *src, unsigned char *other,
                          unsigned char *dst, size_t n, uint64_t promised, int by_digits)
{
    int dominates;
    uint64_t differ, frequent;

    if (n <= job->cap) {
        hxtsort__sort_leaf(job, src, dst, n, HXTSORT__UNKNOWN, 0);
        return;
    }
    differ = job->k.guess(job->map, src, n, &frequent, &dominates);
    if (dominates && differ != 0 && !by_digits)
        hxtsort__sort_dominated(job, src, other, dst, n, frequent);
    else hxtsort__sort_by_digit(job, src, other, dst, n, promised ? promised : differ);
}

/* The same by a digit; guess: the bits in which keys may differ. At most eight of its calls, each
 * with 4 KB of places, are on the stack at a time. */
static void hxtsort__sort_by_digit(const hxtsort__job *job, unsigned char *src,
                                   unsigned char *other, unsigned char *dst, size_t n,
                                   uint64_t guess)
{
    const size_t bytes = job->k.bytes;
    const int threads = job->num_threads;
    size_t start[(1 << HXTSORT__SPLIT_BITS) + 1];
    int bits = HXTSORT__SPLIT_BITS_LEAST, shift, sorted, reversed, t, b, num_buckets;
    uint64_t differ;

    while (bits < HXTSORT__SPLIT_BITS && n * bytes >> bits > HXTSORT__BUCKET_BYTES) bits++;
    num_buckets = 1 << bits;
    differ = hxtsort__count_all(job, src, n, guess, bits, &shift, &sorted, &reversed);
    if (sorted && src != dst) memcpy(dst, src, n * bytes);
    if (reversed && !sorted) hxtsort__reverse(job, src, dst, n);
    if (sorted || reversed) return;

    hxtsort__place(job, start, num_buckets);
    /* every thread writes to its own places in each bucket */
    HXTSORT__PARALLEL_FOR(threads, static)
    for (t = 0; t < threads; t++)
        job->k.split(job->map, src, other, hxtsort__share(n, t, threads),
                      hxtsort__share(n, t + 1, threads), shift, (uint32_t)num_buckets - 1,
                      hxtsort__space_of(job, t));
    differ &= hxtsort__low_bits(shift);
    /* one thread sorts a bucket: it alone writes the bucket's part of dst, and its own buffers */
    HXTSORT__PARALLEL_FOR(threads, dynamic)
    for (b = 0; b < num_buckets; b++) {
        size_t m = start[b + 1] - start[b];
        if (m != 0 && m <= job->cap)
            hxtsort__sort_leaf(job, other + start[b] * bytes, dst + start[b] * bytes, m, differ,
                               HXTSORT__THREAD());
    }
    for (b = 0; b < num_buckets; b++) {
        size_t m = start[b + 1] - start[b], at = start[b] * bytes;
        if (m > job->cap) hxtsort__sort(job, other + at, src + at, dst + at, m, 0, 0);
    }
}

/* ---- >>run  gets the scratch for a job and runs the job -- */
static size_t hxtsort__align(size_t bytes) { return (bytes + 63) & ~(size_t)63; }

/* What a sort of n records needs; total is 0 if the bytes do not fit a size_t. */
typedef struct hxtsort__plan {
    size_t cap, space_bytes, other_bytes, total;
    int    num_threads;
} hxtsort__plan;

static hxtsort__plan hxtsort__make_plan(size_t bytes, size_t n, int num_threads)
{
    hxtsort__plan plan;
    size_t most = SIZE_MAX / 4;

    memset(&plan, 0, sizeof plan);
    plan.cap = HXTSORT__LEAF_BYTES / bytes;
    plan.num_threads = num_threads;
    if (n <= plan.cap) {
        plan.cap = n;
        plan.num_threads = 1;
    } else if ((size_t)num_threads > n / HXTSORT__SHARE) {
        plan.num_threads = n < HXTSORT__SHARE ? 1 : (int)(n / HXTSORT__SHARE);
    }
    plan.space_bytes = hxtsort__align(sizeof(hxtsort__space) + 2 * plan.cap * bytes);
    if (n > most / bytes || (size_t)plan.num_threads > most / plan.space_bytes) return plan;
    plan.other_bytes = n > plan.cap ? hxtsort__align(n * bytes) : 0;
    plan.total = 64 + plan.other_bytes + (size_t)plan.num_threads * plan.space_bytes;
    return plan;
}

/* Sorts n records where they are. opt comes from hxtsort__resolve. */
static hxtsort_result hxtsort__run(hxtsort__kernels k, hxtsort__map map, void *records,
                                   size_t n, const hxtsort_options *opt)
{
    hxtsort__plan plan;
    hxtsort__job job;
    unsigned char *a = (unsigned char *)records, *at;
    void *scratch = NULL;
    hxtsort_result result;
    int t;

    if (n <= HXTSORT__FEW) {
        if (n > 1) k.leaf(map, a, NULL, NULL, a, n, HXTSORT__UNKNOWN, NULL);
        return HXTSORT_OK;
    }
    plan = hxtsort__make_plan(k.bytes, n, opt->num_threads);
    if (plan.total == 0) return HXTSORT_ERROR_TOO_LARGE;
    result = hxtsort__get_scratch(&scratch, opt, plan.total);
    if (result != HXTSORT_OK) return result;
    at = (unsigned char *)scratch + (63 & (0 - (uintptr_t)scratch));
    job.k = k;
    job.map = map;
    job.num_threads = plan.num_threads;
    job.cap = plan.cap;
    job.spaces = at + plan.other_bytes;
    job.space_bytes = plan.space_bytes;
    for (t = 0; t < plan.num_threads; t++)
        hxtsort__space_of(&job, t)->streams = n >= HXTSORT__STREAM_BYTES / k.bytes;
    hxtsort__sort(&job, a, at, a, n,
                  opt->significant_bits ? hxtsort__low_bits(opt->significant_bits) : 0, 0);
    hxtsort__drop_scratch(scratch, opt);
    return HXTSORT_OK;
}

/* The options for a part of the work, without the first `used` bytes of the scratch. */
static hxtsort_options hxtsort__rest(const hxtsort_options *opt, size_t used)
{
    hxtsort_options rest = *opt;

    if (rest.scratch) {
        rest.scratch = (unsigned char *)rest.scratch + used;
        rest.scratch_bytes -= used;
    }
    return rest;
}

/* ---- >>columns  keys and values in separate arrays -- */
/* Copies n elements of 4 or 8 bytes between a column (an array of keys or of values) and the
 * records that the kernels sort, in either direction. */
static void hxtsort__copy_column(unsigned char *to, size_t to_stride, const unsigned char *from,
                                 size_t from_stride, size_t bytes, size_t n, int threads)
{
    int t;

    HXTSORT__PARALLEL_FOR(threads, static)
    for (t = 0; t < threads; t++) {
        size_t i = hxtsort__share(n, t, threads), end = hxtsort__share(n, t + 1, threads);
        if (bytes == 4) {
            for (; i < end; i++) memcpy(to + i * to_stride, from + i * from_stride, 4);
        } else {
            for (; i < end; i++) memcpy(to + i * to_stride, from + i * from_stride, 8);
        }
    }
}

static hxtsort_result hxtsort__sort_columns(hxtsort_type type, void *keys, void *values,
                                            size_t value_bytes, size_t n,
                                            const hxtsort_options *opt)
{
    hxtsort__map map = hxtsort__make_map(type, opt->descending);
    size_t key_bytes = hxtsort__key_bytes(type), bytes = key_bytes + value_bytes, used;
    hxtsort__kernels k = hxtsort__choose(key_bytes, value_bytes, map);
    int threads = hxtsort__make_plan(bytes, n, opt->num_threads).num_threads;
    void *scratch = NULL;
    unsigned char *records;
    hxtsort_options rest;
    hxtsort_result result;

    if (n > SIZE_MAX / 4 / bytes) return HXTSORT_ERROR_TOO_LARGE;
    used = hxtsort__align(n * bytes) + 64;
    result = hxtsort__get_scratch(&scratch, opt, used);
    if (result != HXTSORT_OK) return result;
    records = (unsigned char *)scratch + (63 & (0 - (uintptr_t)scratch));
    hxtsort__copy_column(records, bytes, (unsigned char *)keys, key_bytes, key_bytes, n, threads);
    hxtsort__copy_column(records + key_bytes, bytes, (unsigned char *)values, value_bytes,
                         value_bytes, n, threads);
    rest = hxtsort__rest(opt, used);
    result = hxtsort__run(k, map, records, n, &rest);
    if (result == HXTSORT_OK) {
        hxtsort__copy_column((unsigned char *)keys, key_bytes, records, bytes, key_bytes, n,
                             threads);
        hxtsort__copy_column((unsigned char *)values, value_bytes, records + key_bytes, bytes,
                             value_bytes, n, threads);
    }
    hxtsort__drop_scratch(scratch, opt);
    return result;
}

/* ---- >>orders  argsort, and records moved into an order -- */
/* Where the keys come from: an array of keys, or records and a function. */
typedef struct hxtsort__source {
    const unsigned char *keys; /* the keys, or with fill the records */
    size_t               stride;
    hxtsort_fill        *fill; /* if not NULL, it gives the keys of the records */
} hxtsort__source;

/* Writes (key, index) records for the elements [i, end). */
static void hxtsort__number(unsigned char *records, size_t key_bytes, size_t index_bytes,
                            const hxtsort__source *source, size_t i, size_t end)
{
    const size_t bytes = key_bytes + index_bytes;
    uint64_t bits[256];
    size_t block = end;

    for (; i < end; i++) {
        unsigned char *record = records + i * bytes;
        uint32_t half = (uint32_t)i;
        uint64_t whole = i;

        if (source->fill) {
            if (block == end || i == block + 256) {
                block = i;
                source->fill(bits, source->keys + i * source->stride,
                             end - i < 256 ? end - i : 256);
            }
            memcpy(record, &bits[i - block], 8);
        } else if (key_bytes == 4) {
            memcpy(record, source->keys + i * source->stride, 4);
        } else {
            memcpy(record, source->keys + i * source->stride, 8);
        }
        if (index_bytes == 4) memcpy(record + key_bytes, &half, 4);
        else memcpy(record + key_bytes, &whole, 8);
    }
}

/* Sorts (key, index) records, where an index has 4 bytes if that is enough, and writes the sorted
 * indices to order. */
static hxtsort_result hxtsort__argsort(size_t *order, hxtsort_type type,
                                       const hxtsort__source *source, size_t n,
                                       const hxtsort_options *opt)
{
    hxtsort__map map = hxtsort__make_map(type, opt->descending);
    size_t key_bytes = hxtsort__key_bytes(type), index_bytes = n > UINT32_MAX ? 8 : 4, bytes, used;
    void *scratch = NULL;
    unsigned char *records;
    hxtsort_options rest;
    hxtsort_result result;
    int threads, t;

    if (index_bytes == 8 && key_bytes == 4) return HXTSORT_ERROR_TOO_LARGE;
    bytes = key_bytes + index_bytes;
    if (n > SIZE_MAX / 4 / bytes) return HXTSORT_ERROR_TOO_LARGE;
    threads = hxtsort__make_plan(bytes, n, opt->num_threads).num_threads;
    used = hxtsort__align(n * bytes) + 64;
    result = hxtsort__get_scratch(&scratch, opt, used);
    if (result != HXTSORT_OK) return result;
    records = (unsigned char *)scratch + (63 & (0 - (uintptr_t)scratch));

    HXTSORT__PARALLEL_FOR(threads, static)
    for (t = 0; t < threads; t++)
        hxtsort__number(records, key_bytes, index_bytes, source, hxtsort__share(n, t, threads),
                        hxtsort__share(n, t + 1, threads));
    rest = hxtsort__rest(opt, used);
    result = hxtsort__run(hxtsort__choose(key_bytes, index_bytes, map), map, records, n, &rest);
    if (result == HXTSORT_OK) {
        HXTSORT__PARALLEL_FOR(threads, static)
        for (t = 0; t < threads; t++) {
            size_t i = hxtsort__share(n, t, threads), end = hxtsort__share(n, t + 1, threads);
            for (; i < end; i++) {
                uint32_t half = 0;
                uint64_t whole = 0;
                if (index_bytes == 4) memcpy(&half, records + i * bytes + key_bytes, 4);
                else memcpy(&whole, records + i * bytes + key_bytes, 8);
                order[i] = index_bytes == 4 ? half : (size_t)whole;
            }
        }
    }
    hxtsort__drop_scratch(scratch, opt);
    return result;
}

/* Gathers the records into a copy and copies that back: the cache misses of the gather overlap;
 * those of a walk along the cycles of the permutation would not. */
static hxtsort_result hxtsort__reorder(unsigned char *records, size_t bytes, const size_t *order,
                                       size_t n, const hxtsort_options *opt)
{
    void *scratch = NULL;
    unsigned char *copy;
    hxtsort_result result;
    int threads = hxtsort__make_plan(16, n, opt->num_threads).num_threads, t;

    if (bytes == 0) return HXTSORT_OK;
    if (n > SIZE_MAX / 4 / bytes) return HXTSORT_ERROR_TOO_LARGE;
    result = hxtsort__get_scratch(&scratch, opt, n * bytes);
    if (result != HXTSORT_OK) return result;
    copy = (unsigned char *)scratch;
    HXTSORT__PARALLEL_FOR(threads, static)
    for (t = 0; t < threads; t++) {
        size_t i = hxtsort__share(n, t, threads), end = hxtsort__share(n, t + 1, threads);
        for (; i < end; i++) memcpy(copy + i * bytes, records + order[i] * bytes, bytes);
    }
    HXTSORT__PARALLEL_FOR(threads, static)
    for (t = 0; t < threads; t++) {
        size_t i = hxtsort__share(n, t, threads), end = hxtsort__share(n, t + 1, threads);
        memcpy(records + i * bytes, copy + i * bytes, (end - i) * bytes);
    }
    hxtsort__drop_scratch(scratch, opt);
    return HXTSORT_OK;
}

/* Finds the order of n keys and puts one or two arrays into it: first, which may be the keys
 * themselves, and second, unless it is NULL. All memory is allocated before anything is moved. */
static hxtsort_result hxtsort__sort_by_order(hxtsort_type type, const hxtsort__source *source,
                                             void *first, size_t first_bytes, void *second,
                                             size_t second_bytes, size_t n,
                                             const hxtsort_options *opt)
{
    size_t copy_bytes = first_bytes > second_bytes ? first_bytes : second_bytes, used;
    void *own_order = NULL, *own_copy = NULL;
    size_t *order;
    hxtsort_options rest;
    hxtsort_result result;

    if (n > SIZE_MAX / 64 || (copy_bytes != 0 && n > SIZE_MAX / 8 / copy_bytes))
        return HXTSORT_ERROR_TOO_LARGE;
    used = hxtsort__align(n * sizeof *order) + 64;
    result = hxtsort__get_scratch(&own_order, opt, used);
    if (result != HXTSORT_OK) goto done;
    order = (size_t *)(void *)((unsigned char *)own_order + (63 & (0 - (uintptr_t)own_order)));
    rest = hxtsort__rest(opt, used);
    result = hxtsort__argsort(order, type, source, n, &rest);
    if (result != HXTSORT_OK) goto done;
    result = hxtsort__get_scratch(&own_copy, &rest, n * copy_bytes);
    if (result != HXTSORT_OK) goto done;
    rest.scratch = own_copy;
    rest.scratch_bytes = n * copy_bytes;
    result = hxtsort__reorder((unsigned char *)first, first_bytes, order, n, &rest);
    if (result == HXTSORT_OK && second)
        result = hxtsort__reorder((unsigned char *)second, second_bytes, order, n, &rest);
done:
    hxtsort__drop_scratch(own_copy, opt);
    hxtsort__drop_scratch(own_order, opt);
    return result;
}

/* ---- >>public -- */
HXTSORT_API const char *hxtsort_result_string(hxtsort_result result)
{
    switch (result) {
    case HXTSORT_OK: return "success";
    case HXTSORT_ERROR_INVALID_ARGUMENT: return "invalid argument";
    case HXTSORT_ERROR_OUT_OF_MEMORY: return "out of memory";
    case HXTSORT_CANCELLED: return "cancelled by the caller";
    case HXTSORT_ERROR_TOO_LARGE: return "too large";
    case HXTSORT_ERROR_INTERNAL: return "internal error";
    case HXTSORT_ERROR_SCRATCH_TOO_SMALL: return "the caller's scratch memory is too small";
    }
    return "unknown hxtsort_result";
}

HXTSORT_API size_t hxtsort_scratch_bytes(size_t element_bytes, size_t count, int num_threads)
{
    hxtsort_options asked, opt;
    hxtsort__plan plan;
    size_t each, used;

    memset(&asked, 0, sizeof asked);
    asked.num_threads = num_threads;
    if (hxtsort__resolve(&opt, &asked) != HXTSORT_OK) return 0;
    plan = hxtsort__make_plan(16, count, opt.num_threads);
    each = element_bytes > 16 ? element_bytes : 16;
    if (plan.total == 0 || each > SIZE_MAX / 8 || count > SIZE_MAX / 8 / each) return 0;
    /* the largest need: an order, and beside it (key, index) records or the copy of one array */
    used = hxtsort__align(count * sizeof(size_t)) + 64 + hxtsort__align(count * each) + 64;
    return plan.total > SIZE_MAX - used ? 0 : plan.total + used;
}

/* Keys alone. */
static hxtsort_result hxtsort__keys(hxtsort_type type, void *keys, size_t count,
                                    const hxtsort_options *options)
{
    return hxtsort_by_type(type, keys, NULL, 0, count, options);
}

HXTSORT_API hxtsort_result hxtsort_u32(uint32_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort__keys(HXTSORT_U32, keys, count, options);
}

HXTSORT_API hxtsort_result hxtsort_u64(uint64_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort__keys(HXTSORT_U64, keys, count, options);
}

HXTSORT_API hxtsort_result hxtsort_i32(int32_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort__keys(HXTSORT_I32, keys, count, options);
}

HXTSORT_API hxtsort_result hxtsort_i64(int64_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort__keys(HXTSORT_I64, keys, count, options);
}

HXTSORT_API hxtsort_result hxtsort_f32(float *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort__keys(HXTSORT_F32, keys, count, options);
}

HXTSORT_API hxtsort_result hxtsort_f64(double *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort__keys(HXTSORT_F64, keys, count, options);
}

/* Sorts pairs where they are, as records of 8 or 16 bytes. */
static hxtsort_result hxtsort__sort_pairs(hxtsort_type type, void *pairs, size_t count,
                                          const hxtsort_options *options)
{
    hxtsort_options opt;
    hxtsort__map map;
    size_t key_bytes = hxtsort__key_bytes(type);
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if (count != 0 && !pairs) return HXTSORT_ERROR_INVALID_ARGUMENT;
    map = hxtsort__make_map(type, opt.descending);
    return hxtsort__run(hxtsort__choose(key_bytes, key_bytes, map), map, pairs, count, &opt);
}

HXTSORT_API hxtsort_result hxtsort_pairs(hxtsort_pair *pairs, size_t count,
                                         const hxtsort_options *options)
{
    return hxtsort__sort_pairs(HXTSORT_U64, pairs, count, options);
}

HXTSORT_API hxtsort_result hxtsort_pairs32(hxtsort_pair32 *pairs, size_t count,
                                           const hxtsort_options *options)
{
    return hxtsort__sort_pairs(HXTSORT_U32, pairs, count, options);
}

HXTSORT_API hxtsort_result hxtsort_u32_u32(uint32_t *keys, uint32_t *values, size_t count,
                                           const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_U32, keys, values, sizeof *values, count, options);
}

HXTSORT_API hxtsort_result hxtsort_u64_u32(uint64_t *keys, uint32_t *values, size_t count,
                                           const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_U64, keys, values, sizeof *values, count, options);
}

HXTSORT_API hxtsort_result hxtsort_u64_u64(uint64_t *keys, uint64_t *values, size_t count,
                                           const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_U64, keys, values, sizeof *values, count, options);
}

HXTSORT_API hxtsort_result hxtsort_by_type(hxtsort_type type, void *keys, void *values,
                                           size_t value_bytes, size_t count,
                                           const hxtsort_options *options)
{
    hxtsort_options opt;
    hxtsort__source source;
    hxtsort__map map;
    size_t key_bytes = hxtsort__key_bytes(type);
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if ((unsigned)type > (unsigned)HXTSORT_F64) return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (count != 0 && (!keys || (value_bytes != 0 && !values)))
        return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (count < 2) return HXTSORT_OK;
    map = hxtsort__make_map(type, opt.descending);
    if (value_bytes == 0)
        return hxtsort__run(hxtsort__choose(key_bytes, 0, map), map, keys, count, &opt);
    if (value_bytes == 4 || (value_bytes == 8 && key_bytes == 8))
        return hxtsort__sort_columns(type, keys, values, value_bytes, count, &opt);
    source.keys = (const unsigned char *)keys;
    source.stride = key_bytes;
    source.fill = NULL;
    return hxtsort__sort_by_order(type, &source, keys, key_bytes, values, value_bytes, count, &opt);
}

HXTSORT_API hxtsort_result hxtsort_argsort(size_t *order, hxtsort_type type, const void *keys,
                                           size_t key_stride, size_t count,
                                           const hxtsort_options *options)
{
    hxtsort_options opt;
    hxtsort__source source;
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if ((unsigned)type > (unsigned)HXTSORT_F64 || (count != 0 && (!keys || !order)))
        return HXTSORT_ERROR_INVALID_ARGUMENT;
    source.keys = (const unsigned char *)keys;
    source.stride = key_stride ? key_stride : hxtsort__key_bytes(type);
    source.fill = NULL;
    return hxtsort__argsort(order, type, &source, count, &opt);
}

HXTSORT_API hxtsort_result hxtsort_records(void *records, size_t record_bytes, size_t count,
                                           hxtsort_fill *fill, const hxtsort_options *options)
{
    hxtsort_options opt;
    hxtsort__source source;
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if (!fill || record_bytes == 0 || (count != 0 && !records))
        return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (count < 2) return HXTSORT_OK;
    source.keys = (const unsigned char *)records;
    source.stride = record_bytes;
    source.fill = fill;
    return hxtsort__sort_by_order(HXTSORT_U64, &source, records, record_bytes, NULL, 0, count,
                                  &opt);
}

HXTSORT_API hxtsort_result hxtsort_reorder(void *records, size_t record_bytes, const size_t *order,
                                           size_t count, const hxtsort_options *options)
{
    hxtsort_options opt;
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if (count == 0 || record_bytes == 0) return HXTSORT_OK;
    if (!records || !order) return HXTSORT_ERROR_INVALID_ARGUMENT;
    return hxtsort__reorder((unsigned char *)records, record_bytes, order, count, &opt);
}

#endif /* HXTSORT_IMPLEMENTATION */

/*
This software is available under two licences: choose the one you prefer.

------------------------------------------------------------------------------
ALTERNATIVE A - MIT License

Copyright (c) 2026 the authors of hilbert.h, hxtsort.h, delaunay.h, mesher.h and spr.h

Permission is hereby granted, free of charge, to any person obtaining a copy of
this software and associated documentation files (the "Software"), to deal in
the Software without restriction, including without limitation the rights to
use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies
of the Software, and to permit persons to whom the Software is furnished to do
so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.

------------------------------------------------------------------------------
ALTERNATIVE B - Public Domain (www.unlicense.org)

This is free and unencumbered software released into the public domain.

Anyone is free to copy, modify, publish, use, compile, sell, or distribute this
software, either in source code form or as a compiled binary, for any purpose,
commercial or non-commercial, and by any means.

In jurisdictions that recognize copyright laws, the author or authors of this
software dedicate any and all copyright interest in the software to the public
domain. We make this dedication for the benefit of the public at large and to
the detriment of our heirs and successors. We intend this dedication to be an
overt act of relinquishment in perpetuity of all present and future rights to
this software under copyright law.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN
ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION
WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
*/
