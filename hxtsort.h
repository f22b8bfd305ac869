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
 */

/* ---- >>declarations ------------------------------------------------------ */
#ifndef HXTSORT_H
#define HXTSORT_H
#define HXTSORT_VERSION 100 /* 10000*major + 100*minor + patch */

#include <stddef.h>
#include <stdint.h>

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

/* The family's allocator. Zeroed: malloc and free; else both, called by the calling thread only. */
typedef struct hxtsort_allocator {
    void *(*alloc)(void *user, size_t size);
    void (*release)(void *user, void *memory);
    void *user;
} hxtsort_allocator;

/* Zeroed or NULL: all defaults. */
typedef struct hxtsort_options {
    int               num_threads; /* 0 = omp_get_max_threads() at each call; 1 without OpenMP */
    int               descending;  /* nonzero: greatest first; equal keys keep their order     */
    int               significant_bits; /* a promise: unsigned keys are below 2^bits; 0 = find out */
    hxtsort_allocator allocator;        /* zeros = malloc and free                             */
    void             *scratch;          /* memory to use instead of the allocator, or NULL;    */
    size_t            scratch_bytes;    /* see hxtsort_scratch_bytes                           */
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

/* Scratch that is enough for any sort of count elements of element_bytes (key and value together;
 * for hxtsort_argsort 16) with that many threads; 0 when the size does not fit a size_t. */
HXTSORT_API size_t hxtsort_scratch_bytes(size_t element_bytes, size_t count, int num_threads);

/* Keys alone. On failure they are as before the call. */
HXTSORT_API hxtsort_result hxtsort_u32(uint32_t *keys, size_t count,
                                       const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_u64(uint64_t *keys, size_t count,
                                       const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_i32(int32_t *keys, size_t count, const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_i64(int64_t *keys, size_t count, const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_f32(float *keys, size_t count, const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_f64(double *keys, size_t count, const hxtsort_options *options);

/* Pairs that lie together: the fastest form. */
HXTSORT_API hxtsort_result hxtsort_pairs(hxtsort_pair *pairs, size_t count,
                                         const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_pairs32(hxtsort_pair32 *pairs, size_t count,
                                           const hxtsort_options *options);

/* Keys in one array and their values in another; both are put into the order of the keys. */
HXTSORT_API hxtsort_result hxtsort_u32_u32(uint32_t *keys, uint32_t *values, size_t count,
                                           const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_u64_u32(uint64_t *keys, uint32_t *values, size_t count,
                                           const hxtsort_options *options);
HXTSORT_API hxtsort_result hxtsort_u64_u64(uint64_t *keys, uint64_t *values, size_t count,
                                           const hxtsort_options *options);

/* Any type of key with values of any size (0: none). */
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

#ifdef __cplusplus
}
#endif
#endif /* HXTSORT_H */

/* ---- >>implementation ---------------------------------------------------- */
#if defined(HXTSORT_IMPLEMENTATION) && !defined(HXTSORT_IMPLEMENTATION_DONE)
#define HXTSORT_IMPLEMENTATION_DONE
#include <stdlib.h>
#include <string.h>
#ifdef _OPENMP
#  include <omp.h>
#endif

/* ---- >>memory -- */
static void *hxtsort__malloc(void *user, size_t size)
{
    (void)user;
    return malloc(size);
}

static void hxtsort__free(void *user, void *memory)
{
    (void)user;
    free(memory);
}

/* ---- >>options -- */
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

/* ---- >>order of keys  every type as an unsigned number -- */
static uint64_t hxtsort__load(hxtsort_type type, const void *key, int descending)
{
    uint64_t k = 0, sign;
    uint32_t half;

    if (type == HXTSORT_U32 || type == HXTSORT_I32 || type == HXTSORT_F32) {
        memcpy(&half, key, sizeof half);
        sign = (uint64_t)1 << 31;
        k = half;
    } else {
        memcpy(&k, key, sizeof k);
        sign = (uint64_t)1 << 63;
    }
    if (type == HXTSORT_I32 || type == HXTSORT_I64) k ^= sign;
    if (type == HXTSORT_F32 || type == HXTSORT_F64)
        k = k & sign ? ~k & (sign | (sign - 1)) : k | sign;
    return descending ? ~k & (sign | (sign - 1)) : k;
}

/* ---- >>engine -- */
/* Sorts a by key; b is scratch of the same length. Digits that never change cost nothing. */
static void hxtsort__sort(hxtsort_pair *a, hxtsort_pair *b, size_t count)
{
    hxtsort_pair *home = a;
    uint64_t differ = 0;
    size_t i;
    int shift;

    for (i = 1; i < count; i++) differ |= a[i].key ^ a[0].key;
    for (shift = 0; shift < 64; shift += 8) {
        size_t start[257] = {0};
        hxtsort_pair *other = b;
        int d;

        if ((differ >> shift & 255) == 0) continue;
        for (i = 0; i < count; i++) start[(a[i].key >> shift & 255) + 1]++;
        for (d = 0; d < 256; d++) start[d + 1] += start[d];
        for (i = 0; i < count; i++) b[start[a[i].key >> shift & 255]++] = a[i];
        b = a;
        a = other;
    }
    if (a != home) memcpy(home, a, count * sizeof *a);
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
    size_t threads = num_threads > 0 ? (size_t)num_threads : 64;
    size_t fixed = threads * 65536 + 65536, each = element_bytes + 64;

    if (count > (SIZE_MAX - fixed) / each) return 0;
    return count * each + fixed;
}

HXTSORT_API hxtsort_result hxtsort_by_type(hxtsort_type type, void *keys, void *values,
                                           size_t value_bytes, size_t count,
                                           const hxtsort_options *options)
{
    size_t key_bytes = type == HXTSORT_U32 || type == HXTSORT_I32 || type == HXTSORT_F32 ? 4 : 8;
    size_t each = value_bytes > key_bytes ? value_bytes : key_bytes, i;
    unsigned char *k = (unsigned char *)keys, *v = (unsigned char *)values, *copy;
    hxtsort_options opt;
    hxtsort_pair *pairs;
    void *scratch = NULL;
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if ((unsigned)type > (unsigned)HXTSORT_F64) return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (count == 0) return HXTSORT_OK;
    if (!keys || (value_bytes != 0 && !values)) return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (each > SIZE_MAX - 32 || count > SIZE_MAX / (each + 32)) return HXTSORT_ERROR_TOO_LARGE;
    result = hxtsort__get_scratch(&scratch, &opt, count * (each + 32));
    if (result != HXTSORT_OK) return result;

    pairs = (hxtsort_pair *)scratch;
    copy = (unsigned char *)(pairs + 2 * count);
    for (i = 0; i < count; i++) {
        pairs[i].key = hxtsort__load(type, k + i * key_bytes, opt.descending);
        pairs[i].value = i;
    }
    hxtsort__sort(pairs, pairs + count, count);
    memcpy(copy, k, count * key_bytes);
    for (i = 0; i < count; i++)
        memcpy(k + i * key_bytes, copy + pairs[i].value * key_bytes, key_bytes);
    if (value_bytes != 0) {
        memcpy(copy, v, count * value_bytes);
        for (i = 0; i < count; i++)
            memcpy(v + i * value_bytes, copy + pairs[i].value * value_bytes, value_bytes);
    }
    hxtsort__drop_scratch(scratch, &opt);
    return HXTSORT_OK;
}

HXTSORT_API hxtsort_result hxtsort_u32(uint32_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_U32, keys, NULL, 0, count, options);
}

HXTSORT_API hxtsort_result hxtsort_u64(uint64_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_U64, keys, NULL, 0, count, options);
}

HXTSORT_API hxtsort_result hxtsort_i32(int32_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_I32, keys, NULL, 0, count, options);
}

HXTSORT_API hxtsort_result hxtsort_i64(int64_t *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_I64, keys, NULL, 0, count, options);
}

HXTSORT_API hxtsort_result hxtsort_f32(float *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_F32, keys, NULL, 0, count, options);
}

HXTSORT_API hxtsort_result hxtsort_f64(double *keys, size_t count, const hxtsort_options *options)
{
    return hxtsort_by_type(HXTSORT_F64, keys, NULL, 0, count, options);
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

HXTSORT_API hxtsort_result hxtsort_pairs(hxtsort_pair *pairs, size_t count,
                                         const hxtsort_options *options)
{
    hxtsort_options opt;
    void *scratch = NULL;
    uint64_t flip;
    size_t i;
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if (count == 0) return HXTSORT_OK;
    if (!pairs) return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (count > SIZE_MAX / sizeof *pairs) return HXTSORT_ERROR_TOO_LARGE;
    result = hxtsort__get_scratch(&scratch, &opt, count * sizeof *pairs);
    if (result != HXTSORT_OK) return result;
    flip = opt.descending ? UINT64_MAX : 0;
    for (i = 0; flip && i < count; i++) pairs[i].key ^= flip;
    hxtsort__sort(pairs, (hxtsort_pair *)scratch, count);
    for (i = 0; flip && i < count; i++) pairs[i].key ^= flip;
    hxtsort__drop_scratch(scratch, &opt);
    return HXTSORT_OK;
}

HXTSORT_API hxtsort_result hxtsort_pairs32(hxtsort_pair32 *pairs, size_t count,
                                           const hxtsort_options *options)
{
    hxtsort_options opt;
    hxtsort_pair *wide;
    void *scratch = NULL;
    uint32_t flip;
    size_t i;
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if (count == 0) return HXTSORT_OK;
    if (!pairs) return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (count > SIZE_MAX / (2 * sizeof *wide)) return HXTSORT_ERROR_TOO_LARGE;
    result = hxtsort__get_scratch(&scratch, &opt, 2 * count * sizeof *wide);
    if (result != HXTSORT_OK) return result;
    wide = (hxtsort_pair *)scratch;
    flip = opt.descending ? UINT32_MAX : 0;
    for (i = 0; i < count; i++) {
        wide[i].key = pairs[i].key ^ flip;
        wide[i].value = pairs[i].value;
    }
    hxtsort__sort(wide, wide + count, count);
    for (i = 0; i < count; i++) {
        pairs[i].key = (uint32_t)wide[i].key ^ flip;
        pairs[i].value = (uint32_t)wide[i].value;
    }
    hxtsort__drop_scratch(scratch, &opt);
    return HXTSORT_OK;
}

HXTSORT_API hxtsort_result hxtsort_argsort(size_t *order, hxtsort_type type, const void *keys,
                                           size_t key_stride, size_t count,
                                           const hxtsort_options *options)
{
    size_t key_bytes = type == HXTSORT_U32 || type == HXTSORT_I32 || type == HXTSORT_F32 ? 4 : 8, i;
    hxtsort_options opt;
    hxtsort_pair *pairs;
    void *scratch = NULL;
    hxtsort_result result = hxtsort__resolve(&opt, options);

    if (result != HXTSORT_OK) return result;
    if ((unsigned)type > (unsigned)HXTSORT_F64) return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (count == 0) return HXTSORT_OK;
    if (!keys || !order) return HXTSORT_ERROR_INVALID_ARGUMENT;
    if (key_stride == 0) key_stride = key_bytes;
    if (count > SIZE_MAX / (2 * sizeof *pairs)) return HXTSORT_ERROR_TOO_LARGE;
    result = hxtsort__get_scratch(&scratch, &opt, 2 * count * sizeof *pairs);
    if (result != HXTSORT_OK) return result;
    pairs = (hxtsort_pair *)scratch;
    for (i = 0; i < count; i++) {
        pairs[i].key =
            hxtsort__load(type, (const unsigned char *)keys + i * key_stride, opt.descending);
        pairs[i].value = i;
    }
    hxtsort__sort(pairs, pairs + count, count);
    for (i = 0; i < count; i++) order[i] = (size_t)pairs[i].value;
    hxtsort__drop_scratch(scratch, &opt);
    return HXTSORT_OK;
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
