/* hilbert.h - v0.1.0 - Z-order, Hilbert and Moore curves in 2D and 3D: keys, orders, partitions
 *
 *   #define HILBERT_IMPLEMENTATION      in one .c or .cpp file, then
 *   #include "hilbert.h"                there and anywhere else.
 *
 *   #define HILBERT_IMPLEMENTATION
 *   #include "hilbert.h"
 *   int main(void)
 *   {
 *       double xyz[4][3] = {{0, 0, 0}, {1, 1, 1}, {0, 0, .1}, {1, 1, .9}};
 *       hilbert_points points = {xyz, 0, 4, 3, HILBERT_DOUBLE};
 *       return hilbert_sort_points(xyz, &points, NULL, NULL, NULL); // neighbours now follow
 *   }                                                               // each other in xyz
 *
 *   cc -O3 -fopenmp program.c           (OpenMP is optional: without it, one thread)
 */
/* ---- >>declarations ------------------------------------------------------ */
#ifndef HILBERT_H
#define HILBERT_H
#define HILBERT_VERSION 100 /* 10000*major + 100*minor + patch */

#include <stddef.h>
#include <stdint.h>

#if defined(__FAST_MATH__)
#  error "hilbert.h needs NaN and IEEE rounding: compile it without -ffast-math"
#endif

#ifndef HILBERT_API
#  if !defined(HILBERT_STATIC)
#    define HILBERT_API extern
#  elif defined(__GNUC__)
#    define HILBERT_API static __attribute__((unused))
#  else
#    define HILBERT_API static
#  endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum hilbert_result {
    HILBERT_OK                     = 0,
    HILBERT_ERROR_INVALID_ARGUMENT = -1, /* -1..-15 mean the same in every header */
    HILBERT_ERROR_OUT_OF_MEMORY    = -2,
    HILBERT_CANCELLED              = -3,
    HILBERT_ERROR_TOO_LARGE        = -4,
    HILBERT_ERROR_INTERNAL         = -5,
    HILBERT_ERROR_NO_FINITE_POINT  = -16 /* -16..-31 belong to this header */
} hilbert_result;

typedef enum hilbert_curve {
    HILBERT_CURVE_MOORE   = 0, /* closed: the last cell is a neighbour of the first */
    HILBERT_CURVE_HILBERT = 1, /* open: from corner to corner */
    HILBERT_CURVE_Z       = 2  /* Z-order (Morton): cheaper, with jumps */
} hilbert_curve;

typedef enum hilbert_scalar {
    HILBERT_DOUBLE = 0,
    HILBERT_FLOAT  = 1,
    HILBERT_UINT32 = 2 /* grid coordinates; no box is applied, bits above the depth are cut */
} hilbert_scalar;

/* Where memory comes from. All zero: malloc and free; else both functions, called by the calling
 * thread only. */
typedef struct hilbert_allocator {
    void *(*alloc)(void *user, size_t size);
    void (*release)(void *user, void *memory);
    void *user;
} hilbert_allocator;

/* Zeroed or NULL: all defaults. */
typedef struct hilbert_options {
    int               num_threads; /* 0 = omp_get_max_threads() at each call; 1 without OpenMP */
    int               plain;       /* nonzero: plain C even where vectors are there; same keys */
    hilbert_allocator allocator;   /* zeros = malloc and free */
} hilbert_options;

/* An array of points that stays where it is. Only the first two members must be set to use packed
 * 3D doubles. */
typedef struct hilbert_points {
    const void    *coordinates; /* first coordinate of the first point; the others follow it */
    size_t         stride;      /* bytes from one point to the next; 0 = packed */
    size_t         count;
    int            dimension;   /* 3 or 2; 0 = 3 */
    hilbert_scalar scalar;
} hilbert_points;

/* The grid that a curve runs through: 2^depth cells along every axis between lo and hi. */
typedef struct hilbert_box {
    double        lo[3], hi[3];
    double        middle[3]; /* where the two halves of an axis meet, as a fraction of it, in   */
                             /* (0,1); 0 = 0.5. Other values bend the space (thesis 2.4)        */
    hilbert_curve curve;
    int           depth; /* bits an axis: 1..21 in 3D, 1..32 in 2D; 0 = the most */
    uint64_t      shift; /* added to every key, modulo the number of cells */
} hilbert_box;

/* Two words for 3D grids of more than 21 bits an axis; compare hi, then lo. */
typedef struct hilbert_key128 {
    uint64_t hi, lo;
} hilbert_key128;

/* A section of a curve: the keys from start on, around the end if need be. */
typedef struct hilbert_partition {
    uint64_t start, length;
} hilbert_partition;

HILBERT_API const char *hilbert_result_string(hilbert_result result);

/* Key of one cell, and back. Bits of the coordinates above the depth are ignored.
 *
 *   depth    in   1..21 in 3D, 1..32 in 2D (others: clamped)
 *
 * Repeats  a key at depth k is the key at depth k+1 of any cell inside, without its last digit
 * Source   Marot 2020, Listings 2.8 and 2.10, Table 2.3 (with the closing table corrected)
 */
HILBERT_API uint64_t hilbert_encode3(hilbert_curve curve, int depth, uint32_t x, uint32_t y,
                                     uint32_t z);
HILBERT_API void     hilbert_decode3(hilbert_curve curve, int depth, uint64_t key, uint32_t xyz[3]);
HILBERT_API uint64_t hilbert_encode2(hilbert_curve curve, int depth, uint32_t x, uint32_t y);
HILBERT_API void     hilbert_decode2(hilbert_curve curve, int depth, uint64_t key, uint32_t xy[2]);

/* The smallest box around the finite points, every other member zero (defaults).
 *
 *   box            out
 *   points         in
 *   num_nonfinite  out     points with a NaN or an infinity, which are left out; may be NULL
 *
 * Returns  HILBERT_OK; _ERROR_NO_FINITE_POINT: the box is [0,0]; _ERROR_INVALID_ARGUMENT
 */
HILBERT_API hilbert_result hilbert_box_fit(hilbert_box *box, const hilbert_points *points,
                                           size_t *num_nonfinite, const hilbert_options *options);

/* Lengthens the short axes on both sides until all are as long as the longest: cubic cells. */
HILBERT_API void hilbert_box_cube(hilbert_box *box);

/* Keys of many points.
 *
 *   keys           out     points->count keys
 *   points         in
 *   box            in      points outside it get the nearest cell; NULL = box of the points, cubed
 *   num_nonfinite  out     points with a NaN or an infinity: their key is UINT64_MAX; may be NULL
 *
 * Returns  HILBERT_OK; _ERROR_INVALID_ARGUMENT: a box with lo > hi or not finite, a middle outside
 *          [0,1), a depth too large
 * Repeats  same keys on every machine, for any number of threads, with vectors or without
 */
HILBERT_API hilbert_result hilbert_keys(uint64_t *keys, const hilbert_points *points,
                                        const hilbert_box *box, size_t *num_nonfinite,
                                        const hilbert_options *options);

/* The everyday forms of the two for 3D doubles; stride in bytes, 0 = packed. */
HILBERT_API hilbert_result hilbert_box_fit3(hilbert_box *box, const double *xyz, size_t stride,
                                            size_t count, int num_threads);
HILBERT_API hilbert_result hilbert_keys3(uint64_t *keys, const double *xyz, size_t stride,
                                         size_t count, const hilbert_box *box, int num_threads);

/* The order of the points along the curve: order[i] is the index of the i-th point. Points of one
 * cell stay in their order, points that are not finite come last.
 *
 *   box            in      NULL = box of the points, cubed
 *   sorted_keys    out     keys in that order; may be NULL
 *
 * Cost     24 bytes of scratch for each point
 */
HILBERT_API hilbert_result hilbert_argsort(size_t *order, const hilbert_points *points,
                                           const hilbert_box *box, uint64_t *sorted_keys,
                                           const hilbert_options *options);

/* Puts the points themselves into the order of the curve.
 *
 *   memory   in/out  points->count records of points->stride bytes; the coordinates that points
 *                    describes lie in them (they need not be at the start of a record)
 *   order    out     order[i]: former index of the record now at i; may be NULL
 */
HILBERT_API hilbert_result hilbert_sort_points(void *memory, const hilbert_points *points,
                                               const hilbert_box *box, size_t *order,
                                               const hilbert_options *options);

/* Cuts the curve into sections that hold equal numbers of points: part i begins at the key of the
 * sorted point i*count/num_parts, and the last one wraps around to the first. Points with equal
 * keys fall in one part; a part may thus be empty (length 0). One part for everything is
 * {0, UINT64_MAX}: it holds every key but UINT64_MAX. */
HILBERT_API void hilbert_partition_keys(hilbert_partition *parts, size_t num_parts,
                                        const uint64_t *sorted_keys, size_t count);

/* Whether a key is in a part: one subtraction that wraps and one comparison (thesis 2.9). */
static inline int hilbert_partition_has(hilbert_partition part, uint64_t key)
{
    return (uint64_t)(key - part.start) < part.length;
}

#ifdef __cplusplus
}
#endif
#endif /* HILBERT_H */

/* ---- >>implementation ---------------------------------------------------- */
#if defined(HILBERT_IMPLEMENTATION) && !defined(HILBERT_IMPLEMENTATION_DONE)
#define HILBERT_IMPLEMENTATION_DONE
#ifndef HILBERT_TABLE
#  define HILBERT_TABLE 0
#endif
#include <stdlib.h>
#include <string.h>
#ifdef _OPENMP
#  include <omp.h>
#  define HILBERT__PARALLEL_FOR(n) HILBERT__PRAGMA(omp parallel for num_threads(n) schedule(static))
#  define HILBERT__PRAGMA(text)    _Pragma(#text)
#else
#  define HILBERT__PARALLEL_FOR(n)
#endif

/* ---- >>tables -- */
/* Row = state, column = octant 4*x+2*y+z (digit when decoding), value = 8*next + digit (octant).
 * States 0..11 are the even signed permutations; 12 and 13 begin a closed curve. */
static const unsigned char hilbert__encode_table3[14][8] = {
#if HILBERT_TABLE == 0
    {8, 17, 27, 18, 47, 38, 28, 37},
    {16, 71, 1, 62, 51, 52, 2, 61},
    {0, 75, 95, 76, 9, 10, 86, 85},
    {66, 3, 65, 80, 77, 4, 78, 55},
    {46, 45, 49, 50, 7, 68, 88, 67},
    {84, 83, 5, 58, 39, 72, 6, 57},
    {90, 29, 11, 12, 89, 30, 32, 79},
    {70, 15, 69, 92, 73, 40, 74, 91},
    {36, 63, 35, 24, 13, 14, 82, 81},
    {42, 41, 53, 54, 19, 56, 20, 31},
    {94, 25, 23, 64, 93, 26, 44, 43},
    {60, 21, 87, 22, 59, 34, 48, 33},
    {48, 49, 43, 42, 87, 86, 12, 13},
    {56, 17, 27, 18, 63, 38, 28, 37},
#elif HILBERT_TABLE == 1
    {8, 17, 75, 2, 47, 38, 68, 5},
    {16, 71, 1, 62, 27, 92, 10, 13},
    {0, 51, 95, 44, 9, 18, 86, 21},
    {26, 35, 65, 80, 29, 20, 78, 55},
    {46, 37, 49, 34, 7, 84, 88, 11},
    {28, 91, 45, 42, 39, 72, 6, 57},
    {50, 53, 59, 4, 89, 30, 32, 79},
    {70, 15, 61, 36, 73, 40, 58, 19},
    {52, 63, 43, 24, 69, 14, 66, 81},
    {74, 41, 77, 54, 83, 56, 12, 31},
    {94, 25, 23, 64, 85, 82, 60, 3},
    {76, 93, 87, 22, 67, 90, 48, 33},
    {48, 49, 43, 42, 87, 86, 12, 13},
    {56, 17, 27, 18, 63, 38, 28, 37},
#elif HILBERT_TABLE == 2
    {8, 17, 75, 2, 47, 38, 28, 37},
    {16, 71, 1, 62, 27, 52, 10, 61},
    {0, 51, 95, 76, 9, 18, 86, 85},
    {26, 35, 65, 80, 77, 4, 78, 55},
    {46, 45, 49, 34, 7, 68, 88, 11},
    {84, 91, 5, 42, 39, 72, 6, 57},
    {50, 29, 59, 12, 89, 30, 32, 79},
    {70, 15, 69, 92, 73, 40, 58, 19},
    {36, 63, 43, 24, 13, 14, 66, 81},
    {74, 41, 53, 54, 83, 56, 20, 31},
    {94, 25, 23, 64, 93, 82, 44, 3},
    {60, 21, 87, 22, 67, 90, 48, 33},
    {48, 49, 43, 42, 87, 86, 12, 13},
    {56, 17, 27, 18, 63, 38, 28, 37},
#elif HILBERT_TABLE == 3
    {8, 17, 43, 2, 47, 38, 12, 5},
    {16, 71, 1, 62, 67, 20, 10, 13},
    {0, 91, 95, 4, 9, 18, 86, 21},
    {26, 51, 65, 80, 29, 84, 78, 55},
    {46, 37, 49, 34, 7, 92, 88, 3},
    {76, 35, 45, 42, 39, 72, 6, 57},
    {50, 53, 75, 36, 89, 30, 32, 79},
    {70, 15, 61, 44, 73, 40, 58, 11},
    {28, 63, 59, 24, 69, 14, 66, 81},
    {74, 41, 77, 54, 27, 56, 60, 31},
    {94, 25, 23, 64, 85, 82, 68, 19},
    {52, 93, 87, 22, 83, 90, 48, 33},
    {48, 49, 43, 42, 87, 86, 12, 13},
    {56, 17, 27, 18, 63, 38, 28, 37},
#elif HILBERT_TABLE == 4
    {16, 37, 1, 44, 47, 6, 10, 11},
    {0, 71, 61, 14, 9, 18, 68, 19},
    {8, 17, 95, 2, 85, 92, 22, 3},
    {52, 25, 77, 64, 83, 82, 30, 55},
    {38, 91, 45, 4, 7, 90, 48, 33},
    {74, 41, 75, 36, 39, 56, 46, 5},
    {76, 35, 49, 34, 29, 54, 88, 79},
    {62, 15, 43, 42, 69, 72, 12, 57},
    {26, 63, 65, 80, 27, 70, 60, 13},
    {28, 53, 59, 78, 73, 40, 58, 31},
    {86, 93, 23, 24, 67, 20, 66, 81},
    {50, 51, 87, 94, 89, 84, 32, 21},
    {88, 37, 1, 44, 87, 22, 10, 11},
    {88, 29, 1, 60, 87, 86, 10, 11},
#endif
};
static const unsigned char hilbert__decode_table3[14][8] = {
#if HILBERT_TABLE == 0
    {8, 17, 19, 26, 30, 39, 37, 44},
    {16, 2, 6, 52, 53, 63, 59, 65},
    {0, 12, 13, 73, 75, 87, 86, 90},
    {83, 66, 64, 1, 5, 76, 78, 55},
    {94, 50, 51, 71, 69, 41, 40, 4},
    {77, 63, 59, 81, 80, 2, 6, 36},
    {38, 92, 88, 10, 11, 25, 29, 79},
    {45, 76, 78, 95, 91, 66, 64, 9},
    {27, 87, 86, 34, 32, 12, 13, 57},
    {61, 41, 40, 20, 22, 50, 51, 31},
    {67, 25, 29, 47, 46, 92, 88, 18},
    {54, 39, 37, 60, 56, 17, 19, 82},
    {48, 49, 43, 42, 14, 15, 85, 84},
    {56, 17, 19, 26, 30, 39, 37, 60},
#elif HILBERT_TABLE == 1
    {8, 17, 3, 74, 70, 7, 37, 44},
    {16, 2, 14, 28, 93, 15, 59, 65},
    {0, 12, 21, 49, 43, 23, 86, 90},
    {83, 66, 24, 33, 21, 28, 78, 55},
    {94, 50, 35, 15, 85, 33, 40, 4},
    {77, 63, 43, 89, 24, 42, 6, 36},
    {38, 92, 48, 58, 3, 49, 29, 79},
    {45, 76, 62, 23, 35, 58, 64, 9},
    {27, 87, 70, 42, 48, 68, 13, 57},
    {61, 41, 72, 84, 14, 74, 51, 31},
    {67, 25, 85, 7, 62, 84, 88, 18},
    {54, 39, 93, 68, 72, 89, 19, 82},
    {48, 49, 43, 42, 14, 15, 85, 84},
    {56, 17, 19, 26, 30, 39, 37, 60},
#elif HILBERT_TABLE == 2
    {8, 17, 3, 74, 30, 39, 37, 44},
    {16, 2, 14, 28, 53, 63, 59, 65},
    {0, 12, 21, 49, 75, 87, 86, 90},
    {83, 66, 24, 33, 5, 76, 78, 55},
    {94, 50, 35, 15, 69, 41, 40, 4},
    {77, 63, 43, 89, 80, 2, 6, 36},
    {38, 92, 48, 58, 11, 25, 29, 79},
    {45, 76, 62, 23, 91, 66, 64, 9},
    {27, 87, 70, 42, 32, 12, 13, 57},
    {61, 41, 72, 84, 22, 50, 51, 31},
    {67, 25, 85, 7, 46, 92, 88, 18},
    {54, 39, 93, 68, 56, 17, 19, 82},
    {48, 49, 43, 42, 14, 15, 85, 84},
    {56, 17, 19, 26, 30, 39, 37, 60},
#elif HILBERT_TABLE == 3
    {8, 17, 3, 42, 14, 7, 37, 44},
    {16, 2, 14, 68, 21, 15, 59, 65},
    {0, 12, 21, 89, 3, 23, 86, 90},
    {83, 66, 24, 49, 85, 28, 78, 55},
    {94, 50, 35, 7, 93, 33, 40, 4},
    {77, 63, 43, 33, 72, 42, 6, 36},
    {38, 92, 48, 74, 35, 49, 29, 79},
    {45, 76, 62, 15, 43, 58, 64, 9},
    {27, 87, 70, 58, 24, 68, 13, 57},
    {61, 41, 72, 28, 62, 74, 51, 31},
    {67, 25, 85, 23, 70, 84, 88, 18},
    {54, 39, 93, 84, 48, 89, 19, 82},
    {48, 49, 43, 42, 14, 15, 85, 84},
    {56, 17, 19, 26, 30, 39, 37, 60},
#elif HILBERT_TABLE == 4
    {16, 2, 14, 15, 43, 33, 5, 44},
    {0, 12, 21, 23, 70, 58, 11, 65},
    {8, 17, 3, 7, 93, 84, 22, 90},
    {67, 25, 85, 84, 48, 74, 30, 55},
    {54, 39, 93, 89, 3, 42, 32, 4},
    {61, 41, 72, 74, 35, 7, 46, 36},
    {94, 50, 35, 33, 72, 28, 53, 79},
    {77, 63, 43, 42, 14, 68, 56, 9},
    {83, 66, 24, 28, 62, 15, 69, 57},
    {45, 76, 62, 58, 24, 49, 75, 31},
    {27, 87, 70, 68, 21, 89, 80, 18},
    {38, 92, 48, 49, 85, 23, 91, 82},
    {88, 2, 14, 15, 43, 33, 21, 84},
    {88, 2, 14, 15, 59, 25, 85, 84},
#endif
};
/* The same in 2D: quadrant 2*x+y, value = 4*next + digit; 8 and 9 begin a closed curve. */
static const unsigned char hilbert__encode_table2[10][4] = {
    {4, 1, 11, 2},    {0, 15, 5, 6},    {10, 9, 3, 12},   {14, 7, 13, 8}, {17, 18, 24, 31},
    {27, 28, 22, 21}, {23, 26, 16, 25}, {29, 20, 30, 19}, {12, 1, 15, 2}, {16, 17, 23, 22},
};
static const unsigned char hilbert__decode_table2[10][4] = {
    {4, 1, 3, 10},    {0, 6, 7, 13},    {15, 9, 8, 2},    {11, 14, 12, 5}, {26, 16, 17, 31},
    {29, 23, 22, 24}, {18, 27, 25, 20}, {21, 28, 30, 19}, {12, 1, 3, 14},  {16, 17, 23, 22},
};
#define HILBERT__START3 12
#define HILBERT__START2 8

/* ---- >>memory -- */
static void *hilbert__malloc(void *user, size_t size)
{
    (void)user;
    return malloc(size);
}

static void hilbert__free(void *user, void *memory)
{
    (void)user;
    free(memory);
}

/* An array of at least one element, or NULL; also NULL when the product would wrap. */
static void *hilbert__alloc_array(const hilbert_allocator *a, size_t count, size_t size)
{
    if (count == 0) count = 1;
    if (size != 0 && count > SIZE_MAX / size) return NULL;
    return a->alloc(a->user, count * size);
}

static void hilbert__release(const hilbert_allocator *a, void *memory)
{
    if (memory) a->release(a->user, memory);
}

/* ---- >>options  what zero stands for -- */
#define HILBERT__POINTS_PER_THREAD 16384 /* starting a thread costs about as much as these keys */

static hilbert_result hilbert__resolve(hilbert_options *out, const hilbert_options *in,
                                       size_t count)
{
    size_t enough = count / HILBERT__POINTS_PER_THREAD + 1;

    memset(out, 0, sizeof *out);
    if (in) *out = *in;
    if (out->num_threads < 0 || !out->allocator.alloc != !out->allocator.release)
        return HILBERT_ERROR_INVALID_ARGUMENT;
    if (!out->allocator.alloc) {
        out->allocator.alloc = hilbert__malloc;
        out->allocator.release = hilbert__free;
    }
#ifdef _OPENMP
    if (out->num_threads == 0) out->num_threads = omp_get_max_threads();
#else
    out->num_threads = 1;
#endif
    if ((size_t)out->num_threads > enough) out->num_threads = (int)enough;
    return HILBERT_OK;
}

static hilbert_result hilbert__resolve_points(hilbert_points *out, const hilbert_points *in)
{
    size_t size;

    if (!in) return HILBERT_ERROR_INVALID_ARGUMENT;
    *out = *in;
    if (out->dimension == 0) out->dimension = 3;
    if (out->dimension != 2 && out->dimension != 3) return HILBERT_ERROR_INVALID_ARGUMENT;
    if (out->scalar != HILBERT_DOUBLE && out->scalar != HILBERT_FLOAT &&
        out->scalar != HILBERT_UINT32)
        return HILBERT_ERROR_INVALID_ARGUMENT;
    if (out->count != 0 && !out->coordinates) return HILBERT_ERROR_INVALID_ARGUMENT;
    size = out->scalar == HILBERT_DOUBLE ? sizeof(double) : 4;
    if (out->stride == 0) out->stride = size * (size_t)out->dimension;
    return HILBERT_OK;
}

/* ---- >>curves  one cell at a time  [Marot 2020, Listing 2.8] -- */
static uint64_t hilbert__low_bits(int bits)
{
    return bits >= 64 ? UINT64_MAX : ((uint64_t)1 << bits) - 1;
}

static int hilbert__clamp_depth(int depth, int most)
{
    if (depth < 1) return 1;
    return depth > most ? most : depth;
}

HILBERT_API uint64_t hilbert_encode3(hilbert_curve curve, int depth, uint32_t x, uint32_t y,
                                     uint32_t z)
{
    unsigned state = curve == HILBERT_CURVE_MOORE ? HILBERT__START3 : 0;
    uint64_t key = 0;
    int l;

    for (l = hilbert__clamp_depth(depth, 21) - 1; l >= 0; l--) {
        unsigned o = (x >> l & 1) << 2 | (y >> l & 1) << 1 | (z >> l & 1);
        unsigned entry = curve == HILBERT_CURVE_Z ? o : hilbert__encode_table3[state][o];
        key = key << 3 | (entry & 7);
        state = entry >> 3;
    }
    return key;
}

HILBERT_API void hilbert_decode3(hilbert_curve curve, int depth, uint64_t key, uint32_t xyz[3])
{
    unsigned state = curve == HILBERT_CURVE_MOORE ? HILBERT__START3 : 0;
    uint32_t x = 0, y = 0, z = 0;
    int l;

    for (l = hilbert__clamp_depth(depth, 21) - 1; l >= 0; l--) {
        unsigned h = (unsigned)(key >> 3 * l) & 7;
        unsigned entry = curve == HILBERT_CURVE_Z ? h : hilbert__decode_table3[state][h];
        x = x << 1 | (entry >> 2 & 1);
        y = y << 1 | (entry >> 1 & 1);
        z = z << 1 | (entry & 1);
        state = entry >> 3;
    }
    xyz[0] = x;
    xyz[1] = y;
    xyz[2] = z;
}

HILBERT_API uint64_t hilbert_encode2(hilbert_curve curve, int depth, uint32_t x, uint32_t y)
{
    unsigned state = curve == HILBERT_CURVE_MOORE ? HILBERT__START2 : 0;
    uint64_t key = 0;
    int l;

    for (l = hilbert__clamp_depth(depth, 32) - 1; l >= 0; l--) {
        unsigned q = (x >> l & 1) << 1 | (y >> l & 1);
        unsigned entry = curve == HILBERT_CURVE_Z ? q : hilbert__encode_table2[state][q];
        key = key << 2 | (entry & 3);
        state = entry >> 2;
    }
    return key;
}

HILBERT_API void hilbert_decode2(hilbert_curve curve, int depth, uint64_t key, uint32_t xy[2])
{
    unsigned state = curve == HILBERT_CURVE_MOORE ? HILBERT__START2 : 0;
    uint32_t x = 0, y = 0;
    int l;

    for (l = hilbert__clamp_depth(depth, 32) - 1; l >= 0; l--) {
        unsigned h = (unsigned)(key >> 2 * l) & 3;
        unsigned entry = curve == HILBERT_CURVE_Z ? h : hilbert__decode_table2[state][h];
        x = x << 1 | (entry >> 1 & 1);
        y = y << 1 | (entry & 1);
        state = entry >> 2;
    }
    xy[0] = x;
    xy[1] = y;
}

/* ---- >>grid  from coordinates to cells  [Marot 2020, 2.3 and 2.4] -- */
/* An axis is cut at its centre: cell = half + floor((v - centre) * factor of that side), clamped.
 * Monotone, exact at the centre, and nothing in it can be fused to another rounding. */
typedef struct hilbert__grid {
    double        centre[3], below[3], above[3];
    double        half; /* 2^(depth-1) cells on each side of the centre */
    uint64_t      mask; /* all bits of a key */
    uint64_t      shift;
    hilbert_curve curve;
    int           depth, dimension;
} hilbert__grid;

static int hilbert__is_finite(double v) { return v - v == 0; }

/* Cells per length for half an axis; 0 for an axis without length, never infinite. */
static double hilbert__factor(double half, double from, double to)
{
    double quarter = 0.5 * to - 0.5 * from; /* in halves: the length may not be a double */
    double factor = 0.5 * half / quarter;

    if (!(quarter > 0)) return 0;
    return factor < 1e300 ? factor : 1e300;
}

static hilbert_result hilbert__make_grid(hilbert__grid *g, const hilbert_box *box, int dimension)
{
    int most = dimension == 3 ? 21 : 32;
    int i;

    g->dimension = dimension;
    g->curve = box->curve;
    g->depth = box->depth == 0 ? most : box->depth;
    if (g->depth < 1 || g->depth > most) return HILBERT_ERROR_INVALID_ARGUMENT;
    if ((unsigned)box->curve > (unsigned)HILBERT_CURVE_Z) return HILBERT_ERROR_INVALID_ARGUMENT;
    g->half = (double)((uint64_t)1 << (g->depth - 1));
    g->mask = hilbert__low_bits(g->depth * dimension);
    g->shift = box->shift & g->mask;
    for (i = 0; i < dimension; i++) {
        double lo = box->lo[i], hi = box->hi[i];
        double middle = box->middle[i] == 0 ? 0.5 : box->middle[i];
        double centre = lo * (1 - middle) + hi * middle;

        if (!hilbert__is_finite(lo) || !hilbert__is_finite(hi) || lo > hi || !(middle > 0) ||
            !(middle < 1))
            return HILBERT_ERROR_INVALID_ARGUMENT;
        if (centre < lo) centre = lo;
        if (centre > hi) centre = hi;
        g->centre[i] = centre;
        g->below[i] = hilbert__factor(g->half, lo, centre);
        g->above[i] = hilbert__factor(g->half, centre, hi);
    }
    return HILBERT_OK;
}

static uint32_t hilbert__cell(double v, double centre, double below, double above, double half)
{
    double w = v - centre;
    double u = w * (w < 0 ? below : above);
    int32_t i;

    u = u > -half ? u : -half;
    u = u < half - 1 ? u : half - 1;
    i = (int32_t)u;
    i -= u < (double)i;
    return (uint32_t)i + (uint32_t)half;
}

/* Coordinate i of point p as a double. */
static double hilbert__coordinate(const hilbert_points *points, size_t p, int i)
{
    const unsigned char *at = (const unsigned char *)points->coordinates + p * points->stride;
    double d;
    float f;

    if (points->scalar == HILBERT_DOUBLE) {
        memcpy(&d, at + sizeof d * (size_t)i, sizeof d);
        return d;
    }
    memcpy(&f, at + sizeof f * (size_t)i, sizeof f);
    return (double)f;
}

static uint64_t hilbert__key_of_cell(const hilbert__grid *g, const uint32_t c[3])
{
    uint64_t key = g->dimension == 3 ? hilbert_encode3(g->curve, g->depth, c[0], c[1], c[2])
                                     : hilbert_encode2(g->curve, g->depth, c[0], c[1]);
    return (key + g->shift) & g->mask;
}

/* Key of point p; UINT64_MAX and *bad + 1 for one that is not finite. */
static uint64_t hilbert__key_of_point(const hilbert__grid *g, const hilbert_points *points,
                                      size_t p, size_t *bad)
{
    uint32_t c[3] = {0, 0, 0};
    int i;

    for (i = 0; i < g->dimension; i++) {
        if (points->scalar == HILBERT_UINT32) {
            memcpy(&c[i],
                   (const unsigned char *)points->coordinates + p * points->stride + 4 * (size_t)i,
                   4);
        } else {
            double v = hilbert__coordinate(points, p, i);
            if (!hilbert__is_finite(v)) {
                ++*bad;
                return UINT64_MAX;
            }
            c[i] = hilbert__cell(v, g->centre[i], g->below[i], g->above[i], g->half);
        }
    }
    return hilbert__key_of_cell(g, c);
}

/* ---- >>order  a small stable radix sort of (key, index) -- */
typedef struct hilbert__pair {
    uint64_t key;
    size_t   index;
} hilbert__pair;

/* Sorts a; b is scratch. Returns where the result lies. Digits that never change cost nothing. */
static hilbert__pair *hilbert__sort(hilbert__pair *a, hilbert__pair *b, size_t count)
{
    uint64_t differ = 0;
    size_t i;
    int shift;

    for (i = 1; i < count; i++) differ |= a[i].key ^ a[0].key;
    for (shift = 0; shift < 64; shift += 8) {
        size_t start[257] = {0};
        hilbert__pair *other = b;
        int d;

        if ((differ >> shift & 255) == 0) continue;
        for (i = 0; i < count; i++) start[(a[i].key >> shift & 255) + 1]++;
        for (d = 0; d < 256; d++) start[d + 1] += start[d];
        for (i = 0; i < count; i++) b[start[a[i].key >> shift & 255]++] = a[i];
        b = a;
        a = other;
    }
    return a;
}

/* ---- >>public -- */
HILBERT_API const char *hilbert_result_string(hilbert_result result)
{
    switch (result) {
    case HILBERT_OK: return "success";
    case HILBERT_ERROR_INVALID_ARGUMENT: return "invalid argument";
    case HILBERT_ERROR_OUT_OF_MEMORY: return "out of memory";
    case HILBERT_CANCELLED: return "cancelled by the caller";
    case HILBERT_ERROR_TOO_LARGE: return "too large";
    case HILBERT_ERROR_INTERNAL: return "internal error";
    case HILBERT_ERROR_NO_FINITE_POINT: return "no point has finite coordinates";
    }
    return "unknown hilbert_result";
}

HILBERT_API hilbert_result hilbert_box_fit(hilbert_box *box, const hilbert_points *points,
                                           size_t *num_nonfinite, const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    size_t bad = 0, p;
    int found = 0, i;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if (!box || pts.scalar == HILBERT_UINT32) return HILBERT_ERROR_INVALID_ARGUMENT;
    memset(box, 0, sizeof *box);
    for (p = 0; p < pts.count; p++) {
        double v[3] = {0, 0, 0};
        int finite = 1;

        for (i = 0; i < pts.dimension; i++) {
            v[i] = hilbert__coordinate(&pts, p, i);
            finite &= hilbert__is_finite(v[i]);
        }
        if (!finite) {
            bad++;
            continue;
        }
        for (i = 0; i < pts.dimension; i++) {
            if (!found || v[i] < box->lo[i]) box->lo[i] = v[i];
            if (!found || v[i] > box->hi[i]) box->hi[i] = v[i];
        }
        found = 1;
    }
    if (num_nonfinite) *num_nonfinite = bad;
    return found ? HILBERT_OK : HILBERT_ERROR_NO_FINITE_POINT;
}

HILBERT_API void hilbert_box_cube(hilbert_box *box)
{
    double longest = 0;
    int i;

    for (i = 0; i < 3; i++) {
        double half = 0.5 * box->hi[i] - 0.5 * box->lo[i];
        if (half > longest) longest = half;
    }
    for (i = 0; i < 3; i++) {
        double centre = 0.5 * box->lo[i] + 0.5 * box->hi[i];
        double lo = centre - longest, hi = centre + longest;

        if (lo < box->lo[i] && hilbert__is_finite(lo)) box->lo[i] = lo;
        if (hi > box->hi[i] && hilbert__is_finite(hi)) box->hi[i] = hi;
    }
}

HILBERT_API hilbert_result hilbert_keys(uint64_t *keys, const hilbert_points *points,
                                        const hilbert_box *box, size_t *num_nonfinite,
                                        const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    hilbert_box fitted;
    hilbert__grid grid;
    size_t bad = 0, p;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if (pts.count != 0 && !keys) return HILBERT_ERROR_INVALID_ARGUMENT;
    if (!box) {
        memset(&fitted, 0, sizeof fitted);
        if (pts.scalar != HILBERT_UINT32) {
            result = hilbert_box_fit(&fitted, points, NULL, options);
            if (result != HILBERT_OK && result != HILBERT_ERROR_NO_FINITE_POINT) return result;
            hilbert_box_cube(&fitted);
        }
        box = &fitted;
    }
    result = hilbert__make_grid(&grid, box, pts.dimension);
    if (result != HILBERT_OK) return result;
    for (p = 0; p < pts.count; p++) keys[p] = hilbert__key_of_point(&grid, &pts, p, &bad);
    if (num_nonfinite) *num_nonfinite = bad;
    return HILBERT_OK;
}

HILBERT_API hilbert_result hilbert_box_fit3(hilbert_box *box, const double *xyz, size_t stride,
                                            size_t count, int num_threads)
{
    hilbert_options options;
    hilbert_points points;

    memset(&options, 0, sizeof options);
    memset(&points, 0, sizeof points);
    options.num_threads = num_threads;
    points.coordinates = xyz;
    points.stride = stride;
    points.count = count;
    return hilbert_box_fit(box, &points, NULL, &options);
}

HILBERT_API hilbert_result hilbert_keys3(uint64_t *keys, const double *xyz, size_t stride,
                                         size_t count, const hilbert_box *box, int num_threads)
{
    hilbert_options options;
    hilbert_points points;

    memset(&options, 0, sizeof options);
    memset(&points, 0, sizeof points);
    options.num_threads = num_threads;
    points.coordinates = xyz;
    points.stride = stride;
    points.count = count;
    return hilbert_keys(keys, &points, box, NULL, &options);
}

HILBERT_API hilbert_result hilbert_argsort(size_t *order, const hilbert_points *points,
                                           const hilbert_box *box, uint64_t *sorted_keys,
                                           const hilbert_options *options)
{
    hilbert_options opt;
    uint64_t *keys = NULL;
    hilbert__pair *pairs = NULL, *sorted;
    size_t count, i;
    hilbert_result result;

    if (!points || (points->count != 0 && !order)) return HILBERT_ERROR_INVALID_ARGUMENT;
    count = points->count;
    result = hilbert__resolve(&opt, options, count);
    if (result != HILBERT_OK) return result;
    if (count > SIZE_MAX / 2 / sizeof *pairs) return HILBERT_ERROR_TOO_LARGE;

    result = HILBERT_ERROR_OUT_OF_MEMORY;
    keys = (uint64_t *)hilbert__alloc_array(&opt.allocator, count, sizeof *keys);
    if (!keys) goto done;
    pairs = (hilbert__pair *)hilbert__alloc_array(&opt.allocator, count, 2 * sizeof *pairs);
    if (!pairs) goto done;
    result = hilbert_keys(keys, points, box, NULL, options);
    if (result != HILBERT_OK) goto done;
    for (i = 0; i < count; i++) {
        pairs[i].key = keys[i];
        pairs[i].index = i;
    }
    sorted = hilbert__sort(pairs, pairs + count, count);
    for (i = 0; i < count; i++) order[i] = sorted[i].index;
    if (sorted_keys)
        for (i = 0; i < count; i++) sorted_keys[i] = sorted[i].key;

done:
    hilbert__release(&opt.allocator, pairs);
    hilbert__release(&opt.allocator, keys);
    return result;
}

HILBERT_API hilbert_result hilbert_sort_points(void *memory, const hilbert_points *points,
                                               const hilbert_box *box, size_t *order,
                                               const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    size_t *own_order = NULL;
    unsigned char *copy = NULL, *records = (unsigned char *)memory;
    size_t i;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if (pts.count == 0) return HILBERT_OK;
    if (!memory) return HILBERT_ERROR_INVALID_ARGUMENT;

    result = HILBERT_ERROR_OUT_OF_MEMORY;
    copy = (unsigned char *)hilbert__alloc_array(&opt.allocator, pts.count, pts.stride);
    if (!copy) goto done;
    if (!order) {
        own_order = (size_t *)hilbert__alloc_array(&opt.allocator, pts.count, sizeof *own_order);
        if (!own_order) goto done;
        order = own_order;
    }
    result = hilbert_argsort(order, points, box, NULL, options);
    if (result != HILBERT_OK) goto done;
    for (i = 0; i < pts.count; i++)
        memcpy(copy + i * pts.stride, records + order[i] * pts.stride, pts.stride);
    memcpy(records, copy, pts.count * pts.stride);

done:
    hilbert__release(&opt.allocator, own_order);
    hilbert__release(&opt.allocator, copy);
    return result;
}

HILBERT_API void hilbert_partition_keys(hilbert_partition *parts, size_t num_parts,
                                        const uint64_t *sorted_keys, size_t count)
{
    size_t i;

    if (num_parts == 0) return;
    for (i = 0; i < num_parts; i++) {
        size_t step = count / num_parts, rest = count % num_parts;
        size_t first = i * step + (i < rest ? i : rest);
        parts[i].start = first < count ? sorted_keys[first] : count ? sorted_keys[count - 1] : 0;
    }
    for (i = 0; i + 1 < num_parts; i++) parts[i].length = parts[i + 1].start - parts[i].start;
    parts[i].length = parts[0].start - parts[i].start;
    if (parts[i].start == parts[0].start) { /* all in one place: the last part has it all */
        parts[i].start = 0;
        parts[i].length = UINT64_MAX;
    }
}

#endif /* HILBERT_IMPLEMENTATION */

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
