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
 *
 * Contents (search for the tag)
 *   >>declarations     everyday: single cells, box, keys, order, sorted points, partitions; expert:
 *                      deep keys, k-d pseudo-grid
 *   >>implementation   >>tables >>memory >>options >>curves >>grid >>deep >>steps >>vectors
 *                      >>wide vectors >>box >>order >>kd >>public
 *
 * What it does not do
 *   More than three dimensions; more than 21 bits an axis in a 64-bit 3D key (42 in a 128-bit one)
 *   or 32 in 2D. A point with a NaN or an infinity has no cell: it gets the key UINT64_MAX, comes
 *   last in the order, and is counted. A box wider than DBL_MAX/2 is legal, but its grid is coarse
 *   towards the ends. A thread needs up to 40 KB of stack.
 *
 * How it works  (thesis: C. Marot, Parallel tetrahedral mesh generation, 2020, chapter 2)
 *   A curve is a state machine with a dozen states. From the top bit down, the octant of a point
 *   (one bit of each coordinate) and the state give one digit of the key and the next state. The
 *   states are signed permutations of the axes. The tables are generated from Table 2.3, and a test
 *   proves them: neighbours on the curve are neighbours in space, the closed curve closes, every
 *   cell has one key. (Table 2.4 as printed does not close; tests/test_hilbert.c has closings that
 *   do.)
 *
 *   A coordinate becomes a cell number by floor((v - centre) * factor), clamped; each side of the
 *   centre of an axis has its own factor. This is monotone (but where v - centre overflows on an
 *   axis without length), exact at the centre, and the same on every machine, because a compiler
 *   cannot fuse any two of the operations. With a centre away from the middle of the axis the grid
 *   is finer on one side (2.4).
 *
 *   Plain C takes three levels per step, by look-ups in a table of 14 KB on the stack of the call.
 *   With AVX2, 32 points go down level by level, one byte each, by look-ups in a table of 24 bytes
 *   in two registers; with AVX-512 VBMI, 64 points, whose look-up is one instruction a level. All
 *   three give the same keys. Times for 1e7 points in 3D, doubles to 63-bit Moore keys, on one core
 *   of a server of 2023 (Zen 4, 2.6 GHz), November 2026: AVX2 2.7 ns a point, plain C 33, one level
 *   per step through a table of 96 bytes 60; the bounding box of the points 0.95. On Zen 5, AVX-512
 *   took 1.5, the bounding box 0.8.
 *
 *   A partition is a section of the sorted keys. Since unsigned numbers wrap, one subtraction and
 *   one comparison tell whether a key is in it, even if the section contains the end of the curve
 *   (2.9).
 *
 * Compile-time switches (all for the file with the implementation)
 *   HILBERT_STATIC    off    all functions are static: a private copy (to be defined wherever this
 *                            header is included)
 *   HILBERT_TABLE     BUTZ   HILBERT_TABLE_BUTZ, _CHI, _CC, _CTI, _SI: which 3D curve of Table 2.3.
 *                            Butz cuts a cube into the most compact parts (2 % fewer faces between
 *                            parts than the next best, 12 % fewer than Si)
 *   HILBERT_CLOSING   0      1: the other closed (Moore) curve; with BUTZ in 3D, that of HXT
 *   HILBERT_NO_SIMD   off    plain C only
 *
 * Licence: MIT or public domain, at the end of the file.
 * SPDX-License-Identifier: MIT OR Unlicense
 */

/* ---- >>declarations ------------------------------------------------------ */
#ifndef HILBERT_H
#define HILBERT_H
#define HILBERT_VERSION 100 /* 10000*major + 100*minor + patch */

/* The face-continuous curves of Table 2.3, to set HILBERT_TABLE to. */
#define HILBERT_TABLE_BUTZ 0 /* Ca00.c4I */
#define HILBERT_TABLE_CHI  1 /* Ca00.chI */
#define HILBERT_TABLE_CC   2 /* Ca00.cc.h4.I3.I3 */
#define HILBERT_TABLE_CTI  3 /* Ca00.cTI */
#define HILBERT_TABLE_SI   4 /* Si00.cc.LT.I3.II */

#include <stddef.h>
#include <stdint.h>

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(_M_FP_FAST) ||              \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#  error "hilbert.h needs IEEE arithmetic: no -ffast-math, -fassociative-math, -ffinite-math-only"
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
    HILBERT_UINT32 = 2 /* cell numbers: no box is applied, bits above the depth are ignored */
} hilbert_scalar;

/* Where memory comes from. All zero: malloc and free. Otherwise both functions must be set; only
 * the thread that calls the library calls them. */
typedef struct hilbert_allocator {
    void *(*alloc)(void *user, size_t size);
    void (*release)(void *user, void *memory);
    void *user;
} hilbert_allocator;

/* Zeroed or NULL: all defaults. */
typedef struct hilbert_options {
    int               num_threads; /* 0 = omp_get_max_threads() at each call; 1 without OpenMP */
    int               plain;       /* 1: plain C even if AVX2 is available; 2: at most AVX2;    */
                                   /* 0: the fastest. The keys are the same in all cases        */
    hilbert_allocator allocator;   /* zeros = malloc and free */
} hilbert_options;

/* An array of points in the caller's memory. For packed 3D doubles, set coordinates and count and
 * leave the rest zero. */
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
    double        middle[3]; /* where the halves of an axis meet, as a fraction of its length   */
                             /* in (0,1); 0 = 0.5. Both halves have as many cells (thesis 2.4)  */
    hilbert_curve curve;
    int           depth; /* bits an axis: 1..21 in 3D, 1..32 in 2D; 0 = the most */
    uint64_t      shift; /* added to every key, modulo the number of cells */
} hilbert_box;

/* A key of two words, for 3D grids of more than 21 bits an axis; compare hi, then lo. */
typedef struct hilbert_key128 {
    uint64_t hi, lo;
} hilbert_key128;

/* A section of a curve: `length` keys from start on; it may wrap around the end of the curve. */
typedef struct hilbert_partition {
    uint64_t start, length;
} hilbert_partition;

HILBERT_API const char *hilbert_result_string(hilbert_result result);

/* Key of one cell, and back. Bits of the coordinates above the depth are ignored.
 *
 *   depth    in   1..21 in 3D, 1..32 in 2D (others: clamped)
 *
 * Repeats  the key of a cell at depth k is the key at depth k+1 of any cell inside it, without the
 *          last digit
 * Source   Marot 2020, Listings 2.8 and 2.10, Table 2.3 (with the closing table corrected)
 */
HILBERT_API uint64_t hilbert_encode3(hilbert_curve curve, int depth, uint32_t x, uint32_t y,
                                     uint32_t z);
HILBERT_API void     hilbert_decode3(hilbert_curve curve, int depth, uint64_t key, uint32_t xyz[3]);
HILBERT_API uint64_t hilbert_encode2(hilbert_curve curve, int depth, uint32_t x, uint32_t y);
HILBERT_API void     hilbert_decode2(hilbert_curve curve, int depth, uint64_t key, uint32_t xy[2]);

/* The smallest box around the finite points; all other members are set to zero (defaults).
 *
 *   box            out
 *   points         in
 *   num_nonfinite  out     points with a NaN or an infinity, which are left out; may be NULL
 *
 * Returns  HILBERT_OK; _ERROR_NO_FINITE_POINT: the box is [0,0]; _ERROR_INVALID_ARGUMENT, also for
 *          HILBERT_UINT32, which has no box
 */
HILBERT_API hilbert_result hilbert_box_fit(hilbert_box *box, const hilbert_points *points,
                                           size_t *num_nonfinite, const hilbert_options *options);

/* Lengthens the short axes on both sides until all are as long as the longest, up to rounding:
 * cubic cells. */
HILBERT_API void hilbert_box_cube(hilbert_box *box);

/* Keys of many points.
 *
 *   keys           out     points->count keys
 *   points         in
 *   box            in      points outside it get the nearest cell; NULL = box of the points, cubed
 *   num_nonfinite  out     points with a NaN or an infinity: their key is UINT64_MAX, as is that of
 *                          the curve's last cell in 2D at depth 32; may be NULL
 *
 * Returns  HILBERT_OK; _ERROR_INVALID_ARGUMENT: a box with lo > hi or not finite, a middle outside
 *          [0,1), a depth too large
 * Repeats  same keys on every machine that rounds to doubles (x87 does not), for any number of
 *          threads, with vectors or without
 */
HILBERT_API hilbert_result hilbert_keys(uint64_t *keys, const hilbert_points *points,
                                        const hilbert_box *box, size_t *num_nonfinite,
                                        const hilbert_options *options);

/* hilbert_box_fit and hilbert_keys for 3D doubles; stride in bytes, 0 = packed. */
HILBERT_API hilbert_result hilbert_box_fit3(hilbert_box *box, const double *xyz, size_t stride,
                                            size_t count, int num_threads);
HILBERT_API hilbert_result hilbert_keys3(uint64_t *keys, const double *xyz, size_t stride,
                                         size_t count, const hilbert_box *box, int num_threads);

/* The order of the points along the curve: order[i] is the index of the i-th point. Points of one
 * cell keep their order; points that are not finite come last.
 *
 *   box            in      NULL = box of the points, cubed
 *   sorted_keys    out     keys in that order; may be NULL
 *
 * Returns  as hilbert_keys; _ERROR_OUT_OF_MEMORY; _ERROR_TOO_LARGE: the size of the scratch exceeds
 *          a size_t
 * Cost     40 bytes of scratch for each point. All threads compute keys, but only one sorts: for
 *          millions of points hilbert_keys and then hxtsort_argsort are faster
 */
HILBERT_API hilbert_result hilbert_argsort(size_t *order, const hilbert_points *points,
                                           const hilbert_box *box, uint64_t *sorted_keys,
                                           const hilbert_options *options);

/* Puts the points themselves into the order of the curve.
 *
 *   memory   in/out  points->count records of points->stride bytes; the coordinates that points
 *                    describes lie in them (they need not be at the start of a record)
 *   order    out     order[i]: former index of the record now at i; may be NULL
 *
 * Returns  as hilbert_argsort; after an error the records are as they were
 * Cost     that of hilbert_argsort, and a copy of the records
 */
HILBERT_API hilbert_result hilbert_sort_points(void *memory, const hilbert_points *points,
                                               const hilbert_box *box, size_t *order,
                                               const hilbert_options *options);

/* Cuts the curve into num_parts sections with equal numbers of points; the first count % num_parts
 * of them have one point more (with fewer points than parts, some have one, and the others none).
 * Part i begins at the key of its first sorted point; the last part wraps around to the start of
 * the first. Points with equal keys fall into the same part, so a part may be empty (length 0). A
 * part that has all points is {0, UINT64_MAX}: it holds every key but UINT64_MAX, which a cell has
 * in 2D at depth 32 only. */
HILBERT_API void hilbert_partition_keys(hilbert_partition *parts, size_t num_parts,
                                        const uint64_t *sorted_keys, size_t count);

/* Whether a key is in a part: one subtraction that wraps and one comparison (thesis 2.9). */
static inline int hilbert_partition_has(hilbert_partition part, uint64_t key)
{
    return (uint64_t)(key - part.start) < part.length;
}

/* ---- expert: 3D grids of up to 42 bits an axis; keys of up to 126 bits */
HILBERT_API hilbert_key128 hilbert_encode3_deep(hilbert_curve curve, int depth, uint64_t x,
                                                uint64_t y, uint64_t z);
HILBERT_API void hilbert_decode3_deep(hilbert_curve curve, int depth, hilbert_key128 key,
                                      uint64_t xyz[3]);

/* As hilbert_keys, for 3D points with coordinates in double or float; box->depth 1..42, 0 = 42. A
 * point that is not finite has both words UINT64_MAX. One level per step: this takes about four
 * times as long as hilbert_keys in plain C. */
HILBERT_API hilbert_result hilbert_keys_deep(hilbert_key128 *keys, const hilbert_points *points,
                                             const hilbert_box *box, size_t *num_nonfinite,
                                             const hilbert_options *options);

/* ---- expert: a k-d pseudo-grid (end of thesis 2.9) */
/* A box that is cut in halves with equal numbers of points, axis after axis, until there are
 * 2^levels cells along every axis. Every cell has an equal number of the points that the tree was
 * built from. Zeroed: no tree. */
typedef struct hilbert_kd {
    double *splits;    /* 2^(dimension*levels) - 1, the children of i at 2*i+1 and 2*i+2 */
    int     dimension; /* 2 or 3 */
    int     levels;    /* 1..10 in 3D, 1..15 in 2D */
} hilbert_kd;

/* Builds the tree; the same points in another order give the same tree.
 *
 * Returns  HILBERT_OK; _ERROR_INVALID_ARGUMENT, also for HILBERT_UINT32, and for levels out of
 *          range; _ERROR_OUT_OF_MEMORY; _ERROR_TOO_LARGE: the size of the scratch exceeds a size_t
 * Cost     n * dimension * levels steps of selection in one thread: 0.3 us a point for 1e6 points
 *          and 4 levels in 3D. A key then takes 0.07 us a point; hilbert_keys takes 3 ns. Build the
 *          tree from a sample if that is too much. Scratch of 16 bytes a point; the tree has 8
 *          bytes for each of its 2^(dimension*levels) cells: 8 GiB for 10 levels in 3D
 * Gain     compared with the grid, the rms distance from a point to the centre of its part is 3 %
 *          less for 64 parts of uniform points (about as compact), 10 % less for 64 parts of
 *          clustered points, and 30 % less for 8 parts of them
 */
HILBERT_API hilbert_result hilbert_kd_build(hilbert_kd *kd, const hilbert_points *points,
                                            int levels, const hilbert_options *options);

/* Keys of dimension*levels bits along the curve through the cells of the tree; UINT64_MAX for
 * points that are not finite. hilbert_partition_keys works with them, once sorted, as with any. */
HILBERT_API hilbert_result hilbert_kd_keys(uint64_t *keys, const hilbert_points *points,
                                           const hilbert_kd *kd, hilbert_curve curve,
                                           size_t *num_nonfinite, const hilbert_options *options);

/* Releases the memory of a tree and zeroes it; the allocator of the options must be that of
 * hilbert_kd_build. A zeroed tree is accepted. */
HILBERT_API void hilbert_kd_free(hilbert_kd *kd, const hilbert_options *options);

#ifdef __cplusplus
}
#endif
#endif /* HILBERT_H */

/* ---- >>implementation ---------------------------------------------------- */
#if defined(HILBERT_IMPLEMENTATION) && !defined(HILBERT_IMPLEMENTATION_DONE)
#define HILBERT_IMPLEMENTATION_DONE
#include <float.h>
#ifndef HILBERT_TABLE
#  define HILBERT_TABLE HILBERT_TABLE_BUTZ
#endif
#ifndef HILBERT_CLOSING
#  define HILBERT_CLOSING 0
#endif
#if HILBERT_TABLE < 0 || HILBERT_TABLE > 4 || HILBERT_CLOSING < 0 || HILBERT_CLOSING > 1
#  error "HILBERT_TABLE is 0 to 4, HILBERT_CLOSING 0 or 1"
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
#if defined(__GNUC__) && defined(__x86_64__) && !defined(HILBERT_NO_SIMD)
#  define HILBERT__AVX2 __attribute__((target("avx2")))
#  define HILBERT__AVX512                                                                          \
      __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi")))
#  include <immintrin.h>
#endif

/* ---- >>tables -- */
/* The tables of all five curves are always compiled, so that one test proves them all. Row = state,
 * column = octant 4*x+2*y+z (digit when decoding), value = 8*next + digit (octant when decoding).
 * States 0..11 are the even signed permutations; 12 and 13 begin a closed curve. */
static const unsigned char hilbert__encode_tables3[5][14][8] = {
    {   /* HILBERT_TABLE_BUTZ */
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
    },
    {   /* HILBERT_TABLE_CHI */
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
    },
    {   /* HILBERT_TABLE_CC */
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
    },
    {   /* HILBERT_TABLE_CTI */
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
    },
    {   /* HILBERT_TABLE_SI */
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
    },
};
#define hilbert__encode_table3 hilbert__encode_tables3[HILBERT_TABLE]
static const unsigned char hilbert__decode_tables3[5][14][8] = {
    {   /* HILBERT_TABLE_BUTZ */
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
    },
    {   /* HILBERT_TABLE_CHI */
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
    },
    {   /* HILBERT_TABLE_CC */
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
    },
    {   /* HILBERT_TABLE_CTI */
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
    },
    {   /* HILBERT_TABLE_SI */
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
    },
};
#define hilbert__decode_table3 hilbert__decode_tables3[HILBERT_TABLE]
/* The same in 2D: quadrant 2*x+y, value = 4*next + digit; 8 and 9 begin a closed curve. */
static const unsigned char hilbert__encode_table2[10][4] = {
    {4, 1, 11, 2},    {0, 15, 5, 6},    {10, 9, 3, 12},   {14, 7, 13, 8}, {17, 18, 24, 31},
    {27, 28, 22, 21}, {23, 26, 16, 25}, {29, 20, 30, 19}, {12, 1, 15, 2}, {16, 17, 23, 22},
};
static const unsigned char hilbert__decode_table2[10][4] = {
    {4, 1, 3, 10},    {0, 6, 7, 13},    {15, 9, 8, 2},    {11, 14, 12, 5}, {26, 16, 17, 31},
    {29, 23, 22, 24}, {18, 27, 25, 20}, {21, 28, 30, 19}, {12, 1, 3, 14},  {16, 17, 23, 22},
};
#define HILBERT__START3 (12 + HILBERT_CLOSING)
#define HILBERT__START2 (8 + HILBERT_CLOSING)

/* ---- >>memory -- */
#if defined(__linux__) && (defined(_DEFAULT_SOURCE) || defined(_GNU_SOURCE))
#  include <sys/mman.h>
#endif

/* malloc that asks for huge pages for large blocks, where the system has them: the first access to
 * a page of 4 KB costs more than all work on its contents. */
static void *hilbert__malloc(void *user, size_t size)
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
enum { HILBERT__MOST_THREADS = 1024 };
#define HILBERT__POINTS_PER_THREAD 16384 /* their keys take about as long as starting a thread */

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
    if (out->num_threads > HILBERT__MOST_THREADS) out->num_threads = HILBERT__MOST_THREADS;
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
 * Monotone, exact at the centre, and without operations that a compiler could fuse, and so round
 * otherwise. */
typedef struct hilbert__grid {
    double        centre[3];
    double        factor[3][2]; /* cells per length above the centre, and below */
    double        half;         /* 2^(depth-1) cells on each side of the centre */
    uint64_t      mask; /* all bits of a key */
    uint64_t      shift;
    hilbert_curve curve;
    int           depth, dimension;
} hilbert__grid;

static int hilbert__is_finite(double v) { return v - v == 0; }

/* Cells per length for half an axis; 0 for an axis without length, never infinite. */
static double hilbert__factor(double half, double from, double to)
{
    double quarter = 0.5 * to - 0.5 * from; /* halved, as the length itself may overflow */
    double factor = 0.5 * half / quarter;

    if (!(quarter > 0)) return 0;
    return factor < DBL_MAX ? factor : DBL_MAX;
}

static hilbert_result hilbert__make_grid(hilbert__grid *g, const hilbert_box *box, int dimension,
                                         int most)
{
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
        volatile double from_lo = lo * (1 - middle), from_hi = hi * middle; /* not to be fused */
        double centre = from_lo + from_hi;

        if (!hilbert__is_finite(lo) || !hilbert__is_finite(hi) || lo > hi || !(middle > 0) ||
            !(middle < 1))
            return HILBERT_ERROR_INVALID_ARGUMENT;
        if (centre < lo) centre = lo;
        if (centre > hi) centre = hi;
        g->centre[i] = centre;
        g->factor[i][1] = hilbert__factor(g->half, lo, centre);
        g->factor[i][0] = hilbert__factor(g->half, centre, hi);
    }
    return HILBERT_OK;
}

/* (v - centre) * factor, clamped to [-half, half - 1]; below the centre it is at most -1, even if
 * the product underflows. The values of a side come from arrays, since a branch on the side would
 * be mispredicted half the time. */
static double hilbert__from_centre(const hilbert__grid *g, int axis, double v)
{
    double w = v - g->centre[axis], most[2], u;
    int below = w < 0;

    most[0] = g->half - 1;
    most[1] = -1;
    u = w * g->factor[axis][below];
    u = u > -g->half ? u : -g->half;
    return u < most[below] ? u : most[below];
}

static uint32_t hilbert__cell(const hilbert__grid *g, int axis, double v)
{
    double u = hilbert__from_centre(g, axis, v);
    int32_t i = (int32_t)u;

    i -= u < (double)i;
    return (uint32_t)i + (uint32_t)g->half;
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

static int hilbert__point_is_finite(const hilbert_points *points, size_t p)
{
    int i, finite = 1;

    if (points->scalar == HILBERT_UINT32) return 1;
    for (i = 0; i < points->dimension; i++)
        finite &= hilbert__is_finite(hilbert__coordinate(points, p, i));
    return finite;
}

/* The cell of point p on each axis; returns 0 if the point is not finite. */
static int hilbert__cells_of_point(uint32_t c[3], const hilbert__grid *g,
                                   const hilbert_points *points, size_t p)
{
    const unsigned char *at = (const unsigned char *)points->coordinates + p * points->stride;
    int i;

    for (i = 0; i < g->dimension; i++) {
        if (points->scalar == HILBERT_UINT32) {
            memcpy(&c[i], at + 4 * (size_t)i, 4);
            c[i] &= (uint32_t)hilbert__low_bits(g->depth);
        } else {
            double v = hilbert__coordinate(points, p, i);
            if (!hilbert__is_finite(v)) return 0;
            c[i] = hilbert__cell(g, i, v);
        }
    }
    return 1;
}

/* ---- >>deep  keys of two words -- */
static hilbert_key128 hilbert__push_digit(hilbert_key128 key, unsigned digit)
{
    key.hi = key.hi << 3 | key.lo >> 61;
    key.lo = key.lo << 3 | digit;
    return key;
}

HILBERT_API hilbert_key128 hilbert_encode3_deep(hilbert_curve curve, int depth, uint64_t x,
                                                uint64_t y, uint64_t z)
{
    unsigned state = curve == HILBERT_CURVE_MOORE ? HILBERT__START3 : 0;
    hilbert_key128 key = {0, 0};
    int l;

    for (l = hilbert__clamp_depth(depth, 42) - 1; l >= 0; l--) {
        unsigned o = (unsigned)((x >> l & 1) << 2 | (y >> l & 1) << 1 | (z >> l & 1));
        unsigned entry = curve == HILBERT_CURVE_Z ? o : hilbert__encode_table3[state][o];
        key = hilbert__push_digit(key, entry & 7);
        state = entry >> 3;
    }
    return key;
}

HILBERT_API void hilbert_decode3_deep(hilbert_curve curve, int depth, hilbert_key128 key,
                                      uint64_t xyz[3])
{
    unsigned state = curve == HILBERT_CURVE_MOORE ? HILBERT__START3 : 0;
    uint64_t x = 0, y = 0, z = 0;
    int l;

    for (l = hilbert__clamp_depth(depth, 42) - 1; l >= 0; l--) {
        int at = 3 * l; /* place of the digit's lowest bit in the key */
        uint64_t word = at >= 64 ? key.hi >> (at - 64)
                                 : key.lo >> at | (at > 61 ? key.hi << (64 - at) : 0);
        unsigned h = (unsigned)word & 7;
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

/* As hilbert__cell, with 64 bits. */
static uint64_t hilbert__deep_cell(const hilbert__grid *g, int axis, double v)
{
    double u = hilbert__from_centre(g, axis, v);
    int64_t i = (int64_t)u;

    i -= u < (double)i;
    return (uint64_t)i + (uint64_t)g->half;
}

/* Key of point p. If the point is not finite, both words are UINT64_MAX and *bad is incremented. */
static hilbert_key128 hilbert__deep_key(const hilbert__grid *g, const hilbert_points *points,
                                        size_t p, size_t *bad)
{
    hilbert_key128 key = {UINT64_MAX, UINT64_MAX};
    uint64_t c[3], low;
    int i;

    for (i = 0; i < 3; i++) {
        double v = hilbert__coordinate(points, p, i);
        if (!hilbert__is_finite(v)) {
            ++*bad;
            return key;
        }
        c[i] = hilbert__deep_cell(g, i, v);
    }
    key = hilbert_encode3_deep(g->curve, g->depth, c[0], c[1], c[2]);
    low = key.lo + g->shift;
    key.hi += low < key.lo;
    key.lo = low;
    if (3 * g->depth <= 64) key.hi = 0;
    else key.hi &= hilbert__low_bits(3 * g->depth - 64);
    if (3 * g->depth < 64) key.lo &= hilbert__low_bits(3 * g->depth);
    return key;
}

/* ---- >>steps  three levels of a curve at once, for plain C -- */
/* The table is built on the stack of a call: 14 KB in 3D (3 levels a step, 7 steps for 21 levels),
 * 5 KB in 2D (4 levels a step, 8 steps for 32). One more level a step in 3D would need 112 KB of
 * the L2 cache. The vector code below needs two registers instead. */
#define HILBERT__POINTS_FOR_STEPS 2000 /* from so many on, the table saves more than it costs */

typedef struct hilbert__steps {
    uint16_t entry[14 * 512]; /* by state, then by the bits of 3 (in 2D 4) levels */
} hilbert__steps;

static unsigned hilbert__start_state(hilbert_curve curve, int dimension)
{
    if (curve != HILBERT_CURVE_MOORE) return 0;
    return dimension == 3 ? HILBERT__START3 : HILBERT__START2;
}

/* Entry in 3D: 512*state + digits, index 64*x + 8*y + z of 3 bits each. */
static void hilbert__make_steps3(hilbert__steps *steps, hilbert_curve curve)
{
    unsigned first, i;

    for (first = 0; first < 14; first++)
        for (i = 0; i < 512; i++) {
            unsigned state = first, digits = 0;
            int l;
            for (l = 2; l >= 0; l--) {
                unsigned o = (i >> (6 + l) & 1) << 2 | (i >> (3 + l) & 1) << 1 | (i >> l & 1);
                unsigned entry = curve == HILBERT_CURVE_Z ? o : hilbert__encode_table3[state][o];
                digits = digits << 3 | (entry & 7);
                state = entry >> 3;
            }
            steps->entry[first * 512 + i] = (uint16_t)(state << 9 | digits);
        }
}

/* Entry in 2D: 256*state + digits, index 16*x + y of 4 bits each. */
static void hilbert__make_steps2(hilbert__steps *steps, hilbert_curve curve)
{
    unsigned first, i;

    for (first = 0; first < 10; first++)
        for (i = 0; i < 256; i++) {
            unsigned state = first, digits = 0;
            int l;
            for (l = 3; l >= 0; l--) {
                unsigned q = (i >> (4 + l) & 1) << 1 | (i >> l & 1);
                unsigned entry = curve == HILBERT_CURVE_Z ? q : hilbert__encode_table2[state][q];
                digits = digits << 2 | (entry & 3);
                state = entry >> 2;
            }
            steps->entry[first * 256 + i] = (uint16_t)(state << 8 | digits);
        }
}

/* Key of a cell at full depth; the coordinates are shifted up to 21 or 32 bits. */
static uint64_t hilbert__walk3(const hilbert__steps *steps, unsigned state, uint32_t x, uint32_t y,
                               uint32_t z)
{
    uint64_t key = 0;
    int s;

    state <<= 9;
    for (s = 18; s >= 0; s -= 3) {
        unsigned i = (x >> s & 7) << 6 | (y >> s & 7) << 3 | (z >> s & 7);
        unsigned entry = steps->entry[state | i];
        key = key << 9 | (entry & 511);
        state = entry & ~511u;
    }
    return key;
}

static uint64_t hilbert__walk2(const hilbert__steps *steps, unsigned state, uint32_t x, uint32_t y)
{
    uint64_t key = 0;
    int s;

    state <<= 8;
    for (s = 28; s >= 0; s -= 4) {
        unsigned i = (x >> s & 15) << 4 | (y >> s & 15);
        unsigned entry = steps->entry[state | i];
        key = key << 8 | (entry & 255);
        state = entry & ~255u;
    }
    return key;
}

static void hilbert__make_steps(hilbert__steps *steps, const hilbert__grid *g)
{
    if (g->dimension == 3) hilbert__make_steps3(steps, g->curve);
    else hilbert__make_steps2(steps, g->curve);
}

/* Key of a cell of the grid, level by level if steps is NULL. */
static uint64_t hilbert__key_of_cell(const hilbert__grid *g, const hilbert__steps *steps,
                                     const uint32_t c[3])
{
    const unsigned start = hilbert__start_state(g->curve, g->dimension);
    const int up = (g->dimension == 3 ? 21 : 32) - g->depth;

    if (g->dimension == 3)
        return steps ? hilbert__walk3(steps, start, c[0] << up, c[1] << up, c[2] << up) >> 3 * up
                     : hilbert_encode3(g->curve, g->depth, c[0], c[1], c[2]);
    return steps ? hilbert__walk2(steps, start, c[0] << up, c[1] << up) >> 2 * up
                 : hilbert_encode2(g->curve, g->depth, c[0], c[1]);
}

/* Keys of the points [from, to); returns how many are not finite. */
static size_t hilbert__keys_plain(uint64_t *keys, const hilbert__grid *g,
                                  const hilbert_points *points, const hilbert__steps *steps,
                                  size_t from, size_t to)
{
    size_t bad = 0, p;

    for (p = from; p < to; p++) {
        uint32_t c[3] = {0, 0, 0};
        if (!hilbert__cells_of_point(c, g, points, p)) {
            keys[p] = UINT64_MAX;
            bad++;
            continue;
        }
        keys[p] = (hilbert__key_of_cell(g, steps, c) + g->shift) & g->mask;
    }
    return bad;
}

/* ---- >>vectors  32 points at a time, a byte for each, level by level -- */
#ifdef HILBERT__AVX2
/* The state machine of the curve in two registers. A state is a cyclic shift r of the axes and a
 * mirroring f of some of them: the row of the table for (r, f) is that of (r, 0) with its octants
 * xor f. A state is stored as a byte: f in bits 2 to 0, bit 3 set if r = 1, bit 7 set if r = 2. The
 * octant xor this byte is the index of a look-up. An entry holds the bits of the state that change,
 * and the digit in bits 6 to 4, which a look-up ignores. */
typedef struct hilbert__machine {
    __m256i shifted01, shifted2, start;
} hilbert__machine;

enum { HILBERT__SHIFT1 = 8, HILBERT__SHIFT2 = 128 };

/* The byte of a state. The octant in which the curve begins is the mirroring; the axis of its first
 * step gives the shift. */
static int hilbert__frame(unsigned state)
{
    static const unsigned char shift_of[8] = {0, 0, 1, 0, 2, 0, 0, 0}; /* by the axis, 1, 2 or 4 */
    const unsigned char *row = hilbert__decode_table3[state], *first = hilbert__decode_table3[0];
    int r = (shift_of[(row[0] ^ row[1]) & 7] + 3 - shift_of[(first[0] ^ first[1]) & 7]) % 3;

    return (row[0] & 7) | (r == 1 ? HILBERT__SHIFT1 : 0) | (r == 2 ? HILBERT__SHIFT2 : 0);
}

HILBERT__AVX2 static __m256i hilbert__row_pair(const unsigned char a[8], const unsigned char b[8])
{
    unsigned char rows[16];

    memcpy(rows, a, 8);
    memcpy(rows + 8, b, 8);
    return _mm256_broadcastsi128_si256(_mm_loadu_si128((const __m128i *)(const void *)rows));
}

HILBERT__AVX2 static void hilbert__make_machine(hilbert__machine *m, hilbert_curve curve)
{
    unsigned char rows[4][8]; /* for shifts 0, 1 and 2; for the first level */
    unsigned state, o;

    for (state = 0; state < 12; state++) {
        int frame = hilbert__frame(state);
        int shift = frame & HILBERT__SHIFT2 ? 2 : frame & HILBERT__SHIFT1 ? 1 : 0;
        for (o = 0; o < 8; o++) {
            unsigned entry = hilbert__encode_table3[state][o];
            int change = frame ^ hilbert__frame(entry >> 3);
            int digit = (int)(entry & 7);
            rows[shift][o ^ (unsigned)(frame & 7)] = (unsigned char)(change | digit << 4);
        }
    }
    for (o = 0; o < 8; o++) {
        unsigned entry =
            hilbert__encode_table3[curve == HILBERT_CURVE_MOORE ? HILBERT__START3 : 0][o];
        rows[3][o] = (unsigned char)(hilbert__frame(entry >> 3) | (int)(entry & 7) << 4);
        if (curve == HILBERT_CURVE_Z) rows[0][o] = rows[3][o] = (unsigned char)(o << 4);
    }
    m->shifted01 = hilbert__row_pair(rows[0], rows[1]);
    m->shifted2 = hilbert__row_pair(rows[2], rows[2]);
    m->start = hilbert__row_pair(rows[3], rows[3]);
}

/* Octants of levels b+4 and b, in bits 6 to 4 and 2 to 0 of each byte; the other bits are 0. The
 * bits of x and y are in their places in xy (6, 5, 2 and 1), those of z in z (4 and 0). */
HILBERT__AVX2 static inline __m256i hilbert__octant_pair(__m256i xy, __m256i z)
{
    return _mm256_or_si256(_mm256_and_si256(xy, _mm256_set1_epi8(0x66)),
                           _mm256_and_si256(z, _mm256_set1_epi8(0x11)));
}

/* Octants of the eight levels of one byte of x, y and z: pair[b] has those of levels b+4 and b. */
HILBERT__AVX2 static inline void hilbert__octants(__m256i pair[4], __m256i x, __m256i y, __m256i z)
{
    const __m256i odd = _mm256_set1_epi8((char)0xaa), even = _mm256_set1_epi8(0x55);
    __m256i xy1 = _mm256_or_si256(_mm256_and_si256(x, odd),
                                  _mm256_srli_epi16(_mm256_and_si256(y, odd), 1));
    __m256i xy0 = _mm256_or_si256(_mm256_slli_epi16(_mm256_and_si256(x, even), 1),
                                  _mm256_and_si256(y, even));

    pair[3] = hilbert__octant_pair(_mm256_srli_epi16(xy1, 1), _mm256_srli_epi16(z, 3));
    pair[2] = hilbert__octant_pair(_mm256_srli_epi16(xy0, 1), _mm256_srli_epi16(z, 2));
    pair[1] = hilbert__octant_pair(_mm256_slli_epi16(xy1, 1), _mm256_srli_epi16(z, 1));
    pair[0] = hilbert__octant_pair(_mm256_slli_epi16(xy0, 1), z);
}

/* Transposes 32 cells of one axis: plane[j] has byte j of each. A half of a register has 4 of every
 * 8 points; by_byte brings each 4 into ascending order. */
HILBERT__AVX2 static inline void hilbert__planes(__m256i plane[3], const __m256i cells[4],
                                                 __m256i by_byte)
{
    __m256i t[4], low01, low23, high01, high23;
    int k;

    for (k = 0; k < 4; k++) t[k] = _mm256_shuffle_epi8(cells[k], by_byte);
    low01 = _mm256_unpacklo_epi32(t[0], t[1]);
    low23 = _mm256_unpacklo_epi32(t[2], t[3]);
    high01 = _mm256_unpackhi_epi32(t[0], t[1]);
    high23 = _mm256_unpackhi_epi32(t[2], t[3]);
    plane[0] = _mm256_unpacklo_epi64(low01, low23);
    plane[1] = _mm256_unpackhi_epi64(low01, low23);
    plane[2] = _mm256_unpacklo_epi64(high01, high23);
}

/* The shuffle that groups the bytes of four cells by their rank, lowest first. The arguments are
 * the places of the cells of the first to the fourth point. */
HILBERT__AVX2 static inline __m256i hilbert__by_byte(int first, int second, int third, int fourth)
{
    int places = 4 * (first | second << 8 | third << 16 | fourth << 24);
    return _mm256_broadcastsi128_si256(
        _mm_add_epi8(_mm_set1_epi32(places),
                     _mm_setr_epi8(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3)));
}

HILBERT__AVX2 static inline __m256i hilbert__bits(__m256i v, int mask)
{
    return _mm256_and_si256(v, _mm256_set1_epi8((char)mask));
}

/* Packs eight digits, in bits 6 to 4 of each byte, highest level last, into three bytes of a key,
 * highest last. */
HILBERT__AVX2 static inline void hilbert__join_digits(__m256i bytes[3], const __m256i d[8])
{
    __m256i hi, mid, lo;

    hi = _mm256_slli_epi16(hilbert__bits(d[7], 0x70), 1);
    hi = _mm256_or_si256(hi, _mm256_srli_epi16(hilbert__bits(d[6], 0x70), 2));
    bytes[2] = _mm256_or_si256(hi, _mm256_srli_epi16(hilbert__bits(d[5], 0x60), 5));
    mid = _mm256_slli_epi16(hilbert__bits(d[5], 0x10), 3);
    mid = _mm256_or_si256(mid, hilbert__bits(d[4], 0x70));
    mid = _mm256_or_si256(mid, _mm256_srli_epi16(hilbert__bits(d[3], 0x70), 3));
    bytes[1] = _mm256_or_si256(mid, _mm256_srli_epi16(hilbert__bits(d[2], 0x40), 6));
    lo = _mm256_slli_epi16(hilbert__bits(d[2], 0x30), 2);
    lo = _mm256_or_si256(lo, _mm256_srli_epi16(hilbert__bits(d[1], 0x70), 1));
    bytes[0] = _mm256_or_si256(lo, _mm256_srli_epi16(hilbert__bits(d[0], 0x70), 4));
}

/* Stores 32 keys, given as eight registers with one byte of each key: undoes the transposition of
 * hilbert__planes. */
HILBERT__AVX2 static inline void hilbert__store_keys(uint64_t *keys, const __m256i b[8],
                                                     const hilbert__grid *g, int up)
{
    __m256i h[8], w[8];
    __m256i shift = _mm256_set1_epi64x((long long)g->shift);
    __m256i mask = _mm256_set1_epi64x((long long)g->mask);
    __m128i down = _mm_cvtsi32_si128(3 * up);
    const int is_moved = up != 0 || g->shift != 0;
    int i;

    for (i = 0; i < 4; i++) {
        h[i] = _mm256_unpacklo_epi8(b[2 * i], b[2 * i + 1]);     /* points 0-7 of each half */
        h[i + 4] = _mm256_unpackhi_epi8(b[2 * i], b[2 * i + 1]); /* points 8-15 */
    }
    for (i = 0; i < 2; i++) {
        w[i] = _mm256_unpacklo_epi16(h[2 * i], h[2 * i + 1]);
        w[i + 2] = _mm256_unpackhi_epi16(h[2 * i], h[2 * i + 1]);
        w[i + 4] = _mm256_unpacklo_epi16(h[2 * i + 4], h[2 * i + 5]);
        w[i + 6] = _mm256_unpackhi_epi16(h[2 * i + 4], h[2 * i + 5]);
    }
    for (i = 0; i < 4; i++) { /* points 4*i of each half: 8*i.. and 8*i+4.. of the block */
        __m256i k0 = _mm256_unpacklo_epi32(w[2 * i], w[2 * i + 1]);
        __m256i k1 = _mm256_unpackhi_epi32(w[2 * i], w[2 * i + 1]);
        __m256i lo = _mm256_permute2x128_si256(k0, k1, 0x20);
        __m256i hi = _mm256_permute2x128_si256(k0, k1, 0x31);
        if (is_moved) {
            lo = _mm256_and_si256(_mm256_add_epi64(_mm256_srl_epi64(lo, down), shift), mask);
            hi = _mm256_and_si256(_mm256_add_epi64(_mm256_srl_epi64(hi, down), shift), mask);
        }
        _mm256_storeu_si256((__m256i *)(void *)(keys + 8 * i), lo);
        _mm256_storeu_si256((__m256i *)(void *)(keys + 8 * i + 4), hi);
    }
}

/* Goes one level down: returns the entries, for their digits, and updates the states. A look-up
 * with bit 7 set gives 0, so one of the two look-ups gives the entry and the other gives 0. */
HILBERT__AVX2 static inline __m256i hilbert__level(const hilbert__machine *m, __m256i *state,
                                                   __m256i octants)
{
    __m256i other = _mm256_xor_si256(octants, _mm256_set1_epi8((char)HILBERT__SHIFT2));
    __m256i entry = _mm256_or_si256(
        _mm256_shuffle_epi8(m->shifted01, _mm256_xor_si256(*state, octants)),
        _mm256_shuffle_epi8(m->shifted2, _mm256_xor_si256(*state, other)));
    *state = _mm256_xor_si256(*state, entry);
    return entry;
}

/* Keys of 32 cells. Each axis has four registers of 8 cell numbers of 21 bits. */
HILBERT__AVX2 static inline void hilbert__keys_of_cells(uint64_t *keys,
                                                        const __m256i cells[3][4],
                                                        const __m256i by_byte[3],
                                                        const hilbert__machine *m,
                                                        const hilbert__grid *g, int up)
{
    __m256i bytes[9], x[3], y[3], z[3], pair[4], d[8], state;
    int j;

    hilbert__planes(x, cells[0], by_byte[0]);
    hilbert__planes(y, cells[1], by_byte[1]);
    hilbert__planes(z, cells[2], by_byte[2]);
    hilbert__octants(pair, x[2], y[2], z[2]);
    d[7] = d[6] = d[5] = _mm256_setzero_si256(); /* 21 levels, not 24 */
    d[4] = state = _mm256_shuffle_epi8(m->start, _mm256_srli_epi16(pair[0], 4));
    d[3] = hilbert__level(m, &state, pair[3]);
    d[2] = hilbert__level(m, &state, pair[2]);
    d[1] = hilbert__level(m, &state, pair[1]);
    d[0] = hilbert__level(m, &state, pair[0]);
    hilbert__join_digits(bytes + 6, d);
    for (j = 1; j >= 0; j--) {
        hilbert__octants(pair, x[j], y[j], z[j]);
        d[7] = hilbert__level(m, &state, _mm256_srli_epi16(pair[3], 4));
        d[6] = hilbert__level(m, &state, _mm256_srli_epi16(pair[2], 4));
        d[5] = hilbert__level(m, &state, _mm256_srli_epi16(pair[1], 4));
        d[4] = hilbert__level(m, &state, _mm256_srli_epi16(pair[0], 4));
        d[3] = hilbert__level(m, &state, pair[3]);
        d[2] = hilbert__level(m, &state, pair[2]);
        d[1] = hilbert__level(m, &state, pair[1]);
        d[0] = hilbert__level(m, &state, pair[0]);
        hilbert__join_digits(bytes + 3 * j, d);
    }
    hilbert__store_keys(keys, bytes, g, up);
}

/* Four coordinates to cells; the same steps as hilbert__cell. */
HILBERT__AVX2 static inline __m128i hilbert__four_cells(__m256d v, const hilbert__grid *g, int axis)
{
    __m256d w = _mm256_sub_pd(v, _mm256_set1_pd(g->centre[axis]));
    __m256d is_below = _mm256_cmp_pd(w, _mm256_setzero_pd(), _CMP_LT_OQ);
    __m256d f = _mm256_blendv_pd(_mm256_set1_pd(g->factor[axis][0]),
                                 _mm256_set1_pd(g->factor[axis][1]), is_below);
    __m256d u = _mm256_mul_pd(w, f);

    u = _mm256_max_pd(u, _mm256_set1_pd(-g->half));
    u = _mm256_min_pd(
        u, _mm256_blendv_pd(_mm256_set1_pd(g->half - 1), _mm256_set1_pd(-1), is_below));
    return _mm256_cvttpd_epi32(_mm256_floor_pd(u));
}

/* Two doubles at any addresses, aligned or not. */
HILBERT__AVX2 static inline __m128d hilbert__load_two(const unsigned char *a,
                                                      const unsigned char *b)
{
    double x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    return _mm_set_pd(y, x);
}

HILBERT__AVX2 static inline __m256d hilbert__four_of_axis(const hilbert_points *points, size_t p,
                                                          int axis)
{
    return _mm256_set_pd(
        hilbert__coordinate(points, p + 3, axis), hilbert__coordinate(points, p + 2, axis),
        hilbert__coordinate(points, p + 1, axis), hilbert__coordinate(points, p, axis));
}

/* The coordinates of four points, each axis in a register. */
HILBERT__AVX2 static inline void hilbert__four_points(__m256d v[3], const hilbert_points *points,
                                                      size_t p)
{
    const unsigned char *at = (const unsigned char *)points->coordinates + p * points->stride;
    size_t s = points->stride;

    if (points->scalar == HILBERT_DOUBLE) {
        const double *a = (const double *)(const void *)at;
        const double *b = (const double *)(const void *)(at + s);
        const double *c = (const double *)(const void *)(at + 2 * s);
        const double *d = (const double *)(const void *)(at + 3 * s);
        __m256d ac = _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(a)), _mm_loadu_pd(c),
                                          1);
        __m256d bd = _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(b)), _mm_loadu_pd(d),
                                          1);
        __m128d ab = hilbert__load_two(at + 16, at + s + 16);
        __m128d cd = hilbert__load_two(at + 2 * s + 16, at + 3 * s + 16);
        v[0] = _mm256_unpacklo_pd(ac, bd);
        v[1] = _mm256_unpackhi_pd(ac, bd);
        v[2] = _mm256_insertf128_pd(_mm256_castpd128_pd256(ab), cd, 1);
    } else {
        v[0] = hilbert__four_of_axis(points, p, 0);
        v[1] = hilbert__four_of_axis(points, p, 1);
        v[2] = hilbert__four_of_axis(points, p, 2);
    }
}

/* Whether every coordinate inside the box has the cell half + floor((v - centre) * factor of its
 * side): no product below the centre is so small that it underflows to 0. */
static int hilbert__is_normal(const hilbert__grid *g)
{
    int i;

    for (i = 0; i < 3; i++) {
        double f = g->factor[i][1];
        int is_far = g->centre[i] > 1e-200 || g->centre[i] < -1e-200;
        if (!(f >= 1 || (f > 1e-90 && is_far))) return 0;
    }
    return 1;
}

/* Four packed points fill three registers: x y z x, y z x y and z x y z. For each of the three, the
 * centres and factors of the axes at its places. */
typedef struct hilbert__packed {
    __m256d centre[3], above[3], below[3];
} hilbert__packed;

HILBERT__AVX2 static void hilbert__make_packed(hilbert__packed *to, const hilbert__grid *g)
{
    int r, i;

    for (r = 0; r < 3; r++) {
        double centre[4], above[4], below[4];
        for (i = 0; i < 4; i++) {
            int axis = (4 * r + i) % 3;
            centre[i] = g->centre[axis];
            above[i] = g->factor[axis][0];
            below[i] = g->factor[axis][1];
        }
        to->centre[r] = _mm256_loadu_pd(centre);
        to->above[r] = _mm256_loadu_pd(above);
        to->below[r] = _mm256_loadu_pd(below);
    }
}

/* Cells of 32 packed points in a normal grid (hilbert__is_normal); returns 0 if a point is outside
 * the box. Of every four points, the cells of x are in the order 0 3 2 1, those of y 1 0 3 2, those
 * of z 2 1 0 3. */
HILBERT__AVX2 static inline int hilbert__inner_cells(__m256i cells[3][4], const hilbert__grid *g,
                                                     const hilbert__packed *to, const double *xyz)
{
    const __m256i half = _mm256_set1_epi32((int)g->half);
    const __m256i outside = _mm256_set1_epi32(~(2 * (int)g->half - 1));
    __m256i all = _mm256_setzero_si256();
    int k, r, h;

    for (k = 0; k < 4; k++) {
        __m256i c[3];
        for (r = 0; r < 3; r++) {
            __m128i four[2];
            for (h = 0; h < 2; h++) {
                __m256d v = _mm256_loadu_pd(xyz + 24 * k + 12 * h + 4 * r);
                __m256d w = _mm256_sub_pd(v, to->centre[r]);
                __m256d f = _mm256_blendv_pd(to->above[r], to->below[r], w); /* by its sign */
                four[h] = _mm256_cvttpd_epi32(_mm256_floor_pd(_mm256_mul_pd(w, f)));
            }
            c[r] = _mm256_inserti128_si256(_mm256_castsi128_si256(four[0]), four[1], 1);
            c[r] = _mm256_add_epi32(c[r], half);
            all = _mm256_or_si256(all, c[r]);
        }
        cells[0][k] = _mm256_blend_epi32(_mm256_blend_epi32(c[0], c[1], 0x44), c[2], 0x22);
        cells[1][k] = _mm256_blend_epi32(_mm256_blend_epi32(c[0], c[1], 0x99), c[2], 0x44);
        cells[2][k] = _mm256_blend_epi32(_mm256_blend_epi32(c[0], c[1], 0x22), c[2], 0x99);
    }
    return _mm256_testz_si256(all, outside);
}

/* Cells of any 32 points; returns whether all are finite. */
HILBERT__AVX2 static inline int hilbert__any_cells(__m256i cells[3][4], const hilbert__grid *g,
                                                   const hilbert_points *points, size_t p)
{
    const __m128i half = _mm_set1_epi32((int)g->half);
    __m256d strange = _mm256_setzero_pd();
    int k, i;

    for (k = 0; k < 4; k++) {
        __m256d v[3], w[3];
        hilbert__four_points(v, points, p + 8 * (size_t)k);
        hilbert__four_points(w, points, p + 8 * (size_t)k + 4);
        for (i = 0; i < 3; i++) {
            __m128i lo = _mm_add_epi32(hilbert__four_cells(v[i], g, i), half);
            __m128i hi = _mm_add_epi32(hilbert__four_cells(w[i], g, i), half);
            cells[i][k] = _mm256_inserti128_si256(_mm256_castsi128_si256(lo), hi, 1);
            strange = _mm256_or_pd(strange, _mm256_sub_pd(v[i], v[i]));
            strange = _mm256_or_pd(strange, _mm256_sub_pd(w[i], w[i]));
        }
    }
    return _mm256_testz_si256(_mm256_castpd_si256(strange), _mm256_castpd_si256(strange));
}

/* Keys of the 3D points [from, to), doubles or floats; returns how many are not finite. */
HILBERT__AVX2 static size_t hilbert__keys_avx2(uint64_t *keys, const hilbert__grid *g,
                                               const hilbert_points *points,
                                               size_t from, size_t to)
{
    const int up = 21 - g->depth;
    const int is_packed = points->scalar == HILBERT_DOUBLE &&
                          points->stride == 3 * sizeof(double) && hilbert__is_normal(g);
    const double *xyz = (const double *)points->coordinates;
    const __m256i ascending = hilbert__by_byte(0, 1, 2, 3);
    const __m256i any[3] = {ascending, ascending, ascending};
    const __m256i inner[3] = {hilbert__by_byte(0, 3, 2, 1), hilbert__by_byte(1, 0, 3, 2),
                              hilbert__by_byte(2, 1, 0, 3)};
    hilbert__packed packed;
    hilbert__machine m;
    size_t bad = 0, p, q;

    hilbert__make_machine(&m, g->curve);
    hilbert__make_packed(&packed, g);
    for (p = from; p + 32 <= to; p += 32) {
        __m256i cells[3][4];
        int is_inner = is_packed && hilbert__inner_cells(cells, g, &packed, xyz + 3 * p);
        int is_finite = is_inner || hilbert__any_cells(cells, g, points, p), k, i;

        for (k = 0; up && k < 4; k++)
            for (i = 0; i < 3; i++)
                cells[i][k] = _mm256_sll_epi32(cells[i][k], _mm_cvtsi32_si128(up));
        hilbert__keys_of_cells(keys + p, (const __m256i(*)[4])cells, is_inner ? inner : any, &m, g,
                               up);
        for (q = p; !is_finite && q < p + 32; q++) {
            uint32_t c[3];
            if (hilbert__cells_of_point(c, g, points, q)) continue;
            keys[q] = UINT64_MAX;
            bad++;
        }
    }
    return bad + hilbert__keys_plain(keys, g, points, NULL, p, to);
}

/* Box of the packed 3D doubles [from, to), four points at a time, into box[0..2] and [3..5].
 * Returns 0 if one is not finite. */
HILBERT__AVX2 static int hilbert__fit_avx2(double box[6], const double *xyz, size_t from, size_t to)
{
    __m256d lo[3], hi[3], strange = _mm256_setzero_pd();
    double l[12], h[12], s[4];
    size_t p;
    int i;

    for (i = 0; i < 3; i++) lo[i] = hi[i] = _mm256_loadu_pd(xyz + 3 * from + 4 * i);
    for (p = from; p + 4 <= to; p += 4)
        for (i = 0; i < 3; i++) {
            __m256d v = _mm256_loadu_pd(xyz + 3 * p + 4 * i);
            lo[i] = _mm256_min_pd(lo[i], v);
            hi[i] = _mm256_max_pd(hi[i], v);
            strange = _mm256_or_pd(strange, _mm256_sub_pd(v, v));
        }
    _mm256_storeu_pd(s, strange);
    for (i = 0; i < 3; i++) {
        _mm256_storeu_pd(l + 4 * i, lo[i]);
        _mm256_storeu_pd(h + 4 * i, hi[i]);
        box[i] = l[i];
        box[i + 3] = h[i];
    }
    for (i = 0; i < 12; i++) {
        if (l[i] < box[i % 3]) box[i % 3] = l[i];
        if (h[i] > box[i % 3 + 3]) box[i % 3 + 3] = h[i];
    }
    for (p = to - (to - from) % 4; p < to; p++)
        for (i = 0; i < 3; i++) {
            double v;
            memcpy(&v, xyz + 3 * p + (size_t)i, sizeof v);
            if (v < box[i]) box[i] = v;
            if (v > box[i + 3]) box[i + 3] = v;
            s[0] += v - v;
        }
    return s[0] == 0 && s[1] == 0 && s[2] == 0 && s[3] == 0;
}
/* ---- >>wide vectors  64 points at a time; the whole state machine in one instruction -- */
#  if !defined(__clang__)
#    pragma GCC diagnostic push /* g++ 12 warns of undefined operands in its own headers */
#    pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#    pragma GCC diagnostic ignored "-Wuninitialized"
#  endif

/* The tables and permutations for 64 points. `take` orders the bytes of the cells so that after the
 * three rounds of unpacking at the end register v has the keys of points 8*v to 8*v+7. */
typedef struct hilbert__wide {
    __m512i table[2], start;   /* byte 8*state + octant -> 8*next + digit */
    __m512i take[2];           /* take[0]: bytes 0 and 1 of 32 cells; take[1]: byte 2 */
    __m512i split[3];          /* picks x, y or z from the first two of three registers of points */
    __m512i rest[3];           /* adds those of the third register */
} hilbert__wide;

HILBERT__AVX512 static void hilbert__make_wide(hilbert__wide *m, hilbert_curve curve)
{
    unsigned char table[128], start[64], take[2][64];
    long long split[3][8], rest[3][8];
    int row = curve == HILBERT_CURVE_MOORE ? HILBERT__START3 : 0, i, j;

    for (i = 0; i < 128; i++) {
        int entry = hilbert__encode_table3[i < 112 ? i / 8 : 0][i % 8];
        table[i] = (unsigned char)(curve == HILBERT_CURVE_Z ? i % 8 : entry);
    }
    for (i = 0; i < 64; i++) {
        int point = 8 * (i % 8 / 2) + 2 * (i / 16) + i % 2; /* of 32 */
        start[i] = (unsigned char)(curve == HILBERT_CURVE_Z ? i % 8
                                                            : hilbert__encode_table3[row][i % 8]);
        take[0][i] = (unsigned char)(4 * point + (i % 16 >= 8));
        take[1][i] = (unsigned char)(4 * point + 2);
    }
    for (j = 0; j < 3; j++)
        for (i = 0; i < 8; i++) {
            int at = 3 * i + j; /* of 24 doubles */
            split[j][i] = at < 16 ? at : 0;
            rest[j][i] = at < 16 ? i : at - 8;
        }
    m->table[0] = _mm512_loadu_si512(table);
    m->table[1] = _mm512_loadu_si512(table + 64);
    m->start = _mm512_loadu_si512(start);
    for (j = 0; j < 2; j++) m->take[j] = _mm512_loadu_si512(take[j]);
    for (j = 0; j < 3; j++) {
        m->split[j] = _mm512_loadu_si512(split[j]);
        m->rest[j] = _mm512_loadu_si512(rest[j]);
    }
}

/* Bits of a where the mask is set, of b elsewhere. */
HILBERT__AVX512 static inline __m512i hilbert__choose(__m512i a, __m512i b, int mask)
{
    return _mm512_ternarylogic_epi32(a, b, _mm512_set1_epi8((char)mask), 0xe4);
}

/* v shifted to the left, or to the right if left is negative. Words of 16 bits are shifted, so the
 * caller must mask the bits that cross from one byte to the other. */
HILBERT__AVX512 static inline __m512i hilbert__shifted(__m512i v, int left)
{
    return left >= 0 ? _mm512_sll_epi16(v, _mm_cvtsi32_si128(left))
                     : _mm512_srl_epi16(v, _mm_cvtsi32_si128(-left));
}

/* Octants of level b: bit b of x, y and z as bits 2, 1 and 0; the other bits are undefined. */
HILBERT__AVX512 static inline __m512i hilbert__wide_octants(const __m512i plane[3], int b)
{
    __m512i yz = hilbert__choose(hilbert__shifted(plane[1], 1 - b), hilbert__shifted(plane[2], -b),
                                 2);
    return hilbert__choose(hilbert__shifted(plane[0], 2 - b), yz, 4);
}

/* Packs the digits of eight entries, highest level last, into three bytes of a key. */
HILBERT__AVX512 static inline void hilbert__wide_join(__m512i bytes[3], const __m512i d[8])
{
    __m512i t;

    t = hilbert__choose(hilbert__shifted(d[7], 5), hilbert__shifted(d[6], 2), 0xe0);
    bytes[2] = hilbert__choose(t, hilbert__shifted(d[5], -1), 0xfc);
    t = hilbert__choose(hilbert__shifted(d[5], 7), hilbert__shifted(d[4], 4), 0x80);
    t = hilbert__choose(t, hilbert__shifted(d[3], 1), 0xf0);
    bytes[1] = hilbert__choose(t, hilbert__shifted(d[2], -2), 0xfe);
    t = hilbert__choose(hilbert__shifted(d[2], 6), hilbert__shifted(d[1], 3), 0xc0);
    bytes[0] = hilbert__choose(t, d[0], 0xf8);
}

/* Stores 64 keys, given as eight registers with one byte of each key. */
HILBERT__AVX512 static inline void hilbert__wide_store(uint64_t *keys, const __m512i b[8],
                                                       const hilbert__grid *g, int up)
{
    __m512i h[8], w[8], shift = _mm512_set1_epi64((long long)g->shift);
    __m512i mask = _mm512_set1_epi64((long long)g->mask);
    __m128i down = _mm_cvtsi32_si128(3 * up);
    int i;

    for (i = 0; i < 4; i++) {
        h[i] = _mm512_unpacklo_epi8(b[2 * i], b[2 * i + 1]);
        h[i + 4] = _mm512_unpackhi_epi8(b[2 * i], b[2 * i + 1]);
    }
    for (i = 0; i < 2; i++) {
        w[i] = _mm512_unpacklo_epi16(h[2 * i], h[2 * i + 1]);
        w[i + 2] = _mm512_unpackhi_epi16(h[2 * i], h[2 * i + 1]);
        w[i + 4] = _mm512_unpacklo_epi16(h[2 * i + 4], h[2 * i + 5]);
        w[i + 6] = _mm512_unpackhi_epi16(h[2 * i + 4], h[2 * i + 5]);
    }
    for (i = 0; i < 8; i++) {
        __m512i k = i % 2 ? _mm512_unpackhi_epi32(w[i - 1], w[i])
                          : _mm512_unpacklo_epi32(w[i], w[i + 1]);
        k = _mm512_and_si512(_mm512_add_epi64(_mm512_srl_epi64(k, down), shift), mask);
        _mm512_storeu_si512(keys + 8 * i, k);
    }
}

/* The entries one level down, at bit b of the planes. */
HILBERT__AVX512 static inline __m512i hilbert__wide_level(const hilbert__wide *m, __m512i entry,
                                                          const __m512i plane[3], int b)
{
    __m512i i = hilbert__choose(entry, hilbert__wide_octants(plane, b), 0x78);
    return _mm512_permutex2var_epi8(m->table[0], i, m->table[1]);
}

/* Keys of 64 cells. Each axis has four registers of 16 cell numbers of 21 bits. */
HILBERT__AVX512 static inline void hilbert__wide_keys(uint64_t *keys, const __m512i cells[3][4],
                                                      const hilbert__wide *m,
                                                      const hilbert__grid *g, int up)
{
    __m512i planes[3][3], bytes[9], d[8], entry;
    int a, j;

    for (a = 0; a < 3; a++) {
        __m512i lo = _mm512_permutex2var_epi8(cells[a][0], m->take[0], cells[a][1]);
        __m512i hi = _mm512_permutex2var_epi8(cells[a][2], m->take[0], cells[a][3]);
        planes[0][a] = _mm512_unpacklo_epi64(lo, hi);
        planes[1][a] = _mm512_unpackhi_epi64(lo, hi);
        lo = _mm512_permutex2var_epi8(cells[a][0], m->take[1], cells[a][1]);
        hi = _mm512_permutex2var_epi8(cells[a][2], m->take[1], cells[a][3]);
        planes[2][a] = _mm512_unpacklo_epi64(lo, hi);
    }
    entry = _mm512_permutexvar_epi8(hilbert__choose(hilbert__wide_octants(planes[2], 4),
                                                    _mm512_setzero_si512(), 7),
                                    m->start);
    d[7] = d[6] = d[5] = _mm512_setzero_si512(); /* 21 levels, not 24 */
    d[4] = entry;
    d[3] = entry = hilbert__wide_level(m, entry, planes[2], 3);
    d[2] = entry = hilbert__wide_level(m, entry, planes[2], 2);
    d[1] = entry = hilbert__wide_level(m, entry, planes[2], 1);
    d[0] = entry = hilbert__wide_level(m, entry, planes[2], 0);
    hilbert__wide_join(bytes + 6, d);
    for (j = 1; j >= 0; j--) {
        d[7] = entry = hilbert__wide_level(m, entry, planes[j], 7);
        d[6] = entry = hilbert__wide_level(m, entry, planes[j], 6);
        d[5] = entry = hilbert__wide_level(m, entry, planes[j], 5);
        d[4] = entry = hilbert__wide_level(m, entry, planes[j], 4);
        d[3] = entry = hilbert__wide_level(m, entry, planes[j], 3);
        d[2] = entry = hilbert__wide_level(m, entry, planes[j], 2);
        d[1] = entry = hilbert__wide_level(m, entry, planes[j], 1);
        d[0] = entry = hilbert__wide_level(m, entry, planes[j], 0);
        hilbert__wide_join(bytes + 3 * j, d);
    }
    hilbert__wide_store(keys, bytes, g, up);
}

/* The coordinates of eight points, each axis in a register. */
HILBERT__AVX512 static inline void hilbert__eight_points(__m512d v[3], const hilbert__wide *m,
                                                         const hilbert_points *points, size_t p)
{
    int i;

    if (points->scalar == HILBERT_DOUBLE && points->stride == 3 * sizeof(double)) {
        const double *at = (const double *)points->coordinates + 3 * p;
        __m512d a = _mm512_loadu_pd(at), b = _mm512_loadu_pd(at + 8), c = _mm512_loadu_pd(at + 16);
        for (i = 0; i < 3; i++)
            v[i] = _mm512_permutex2var_pd(_mm512_permutex2var_pd(a, m->split[i], b), m->rest[i], c);
    } else {
        __m256d lo[3], hi[3];
        hilbert__four_points(lo, points, p);
        hilbert__four_points(hi, points, p + 4);
        v[0] = _mm512_insertf64x4(_mm512_castpd256_pd512(lo[0]), hi[0], 1);
        v[1] = _mm512_insertf64x4(_mm512_castpd256_pd512(lo[1]), hi[1], 1);
        v[2] = _mm512_insertf64x4(_mm512_castpd256_pd512(lo[2]), hi[2], 1);
    }
}

/* Eight coordinates to cells; the same steps as hilbert__cell. */
HILBERT__AVX512 static inline __m256i hilbert__eight_cells(__m512d v, const hilbert__grid *g,
                                                           int axis)
{
    __m512d w = _mm512_sub_pd(v, _mm512_set1_pd(g->centre[axis]));
    __mmask8 is_below = _mm512_cmp_pd_mask(w, _mm512_setzero_pd(), _CMP_LT_OQ);
    __m512d f = _mm512_mask_blend_pd(is_below, _mm512_set1_pd(g->factor[axis][0]),
                                     _mm512_set1_pd(g->factor[axis][1]));
    __m512d u = _mm512_mul_pd(w, f);

    u = _mm512_max_pd(u, _mm512_set1_pd(-g->half));
    u = _mm512_min_pd(
        u, _mm512_mask_blend_pd(is_below, _mm512_set1_pd(g->half - 1), _mm512_set1_pd(-1)));
    return _mm512_cvt_roundpd_epi32(u, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
}

/* As hilbert__keys_avx2. */
HILBERT__AVX512 static size_t hilbert__keys_avx512(uint64_t *keys, const hilbert__grid *g,
                                                   const hilbert_points *points,
                                                   size_t from,
                                                   size_t to)
{
    const int up = 21 - g->depth;
    const __m512i half = _mm512_set1_epi32((int)g->half);
    const __m128i shift = _mm_cvtsi32_si128(up);
    hilbert__wide m;
    size_t bad = 0, p, q;

    hilbert__make_wide(&m, g->curve);
    for (p = from; p + 64 <= to; p += 64) {
        __m512i cells[3][4];
        unsigned strange = 0;
        int k, i;

        for (k = 0; k < 4; k++) {
            __m512d v[3], w[3];
            hilbert__eight_points(v, &m, points, p + 16 * (size_t)k);
            hilbert__eight_points(w, &m, points, p + 16 * (size_t)k + 8);
            for (i = 0; i < 3; i++) {
                __m512i c = _mm512_inserti64x4(
                    _mm512_castsi256_si512(hilbert__eight_cells(v[i], g, i)),
                    hilbert__eight_cells(w[i], g, i), 1);
                cells[i][k] = _mm512_sll_epi32(_mm512_add_epi32(c, half), shift);
                strange |= (unsigned)_mm512_fpclass_pd_mask(v[i], 0x99); /* NaN or infinite */
                strange |= (unsigned)_mm512_fpclass_pd_mask(w[i], 0x99);
            }
        }
        hilbert__wide_keys(keys + p, (const __m512i(*)[4])cells, &m, g, up);
        for (q = p; strange && q < p + 64; q++) {
            uint32_t c[3];
            if (hilbert__cells_of_point(c, g, points, q)) continue;
            keys[q] = UINT64_MAX;
            bad++;
        }
    }
    return bad + hilbert__keys_plain(keys, g, points, NULL, p, to);
}
#  if !defined(__clang__)
#    pragma GCC diagnostic pop
#  endif
#endif /* HILBERT__AVX2 */

/* Which code to run. 0: plain C; 2: AVX2; 5: AVX-512 with byte permutations. */
static int hilbert__vectors(const hilbert_options *opt)
{
#ifdef HILBERT__AVX2
    if (opt->plain == 1 || !__builtin_cpu_supports("avx2")) return 0;
    if (opt->plain == 2 || !__builtin_cpu_supports("avx512vbmi") ||
        !__builtin_cpu_supports("avx512bw") || !__builtin_cpu_supports("avx512dq") ||
        !__builtin_cpu_supports("avx512vl"))
        return 2;
    return 5;
#else
    (void)opt;
    return 0;
#endif
}

/* Keys of the points [from, to); returns how many are not finite. */
static size_t hilbert__keys_range(uint64_t *keys, const hilbert__grid *g,
                                  const hilbert_points *points, const hilbert__steps *steps,
                                  size_t from, size_t to, int vectors)
{
#ifdef HILBERT__AVX2
    if (vectors == 5) return hilbert__keys_avx512(keys, g, points, from, to);
    if (vectors) return hilbert__keys_avx2(keys, g, points, from, to);
#endif
    (void)vectors;
    return hilbert__keys_plain(keys, g, points, steps, from, to);
}

/* ---- >>box  around many points -- */
#define HILBERT__MOST_PARTS 64 /* the points are dealt out in at most so many shares */

typedef struct hilbert__extent {
    double box[6]; /* lo, then hi */
    size_t bad;    /* points that are not finite */
    int    found;  /* whether there is a finite one */
} hilbert__extent;

static int hilbert__num_parts(const hilbert_options *opt)
{
    return opt->num_threads < HILBERT__MOST_PARTS ? opt->num_threads : HILBERT__MOST_PARTS;
}

/* First point of share t when n points are dealt out in num_parts shares. */
static size_t hilbert__share(size_t n, int t, int num_parts)
{
    size_t each = n / (size_t)num_parts, rest = n % (size_t)num_parts;
    return each * (size_t)t + ((size_t)t < rest ? (size_t)t : rest);
}

static void hilbert__join_extents(hilbert__extent *to, const hilbert__extent *from, int dimension)
{
    int i;

    for (i = 0; from->found && i < dimension; i++) {
        if (!to->found || from->box[i] < to->box[i]) to->box[i] = from->box[i];
        if (!to->found || from->box[i + 3] > to->box[i + 3]) to->box[i + 3] = from->box[i + 3];
    }
    to->found |= from->found;
    to->bad += from->bad;
}

static void hilbert__fit_range(hilbert__extent *extent, const hilbert_points *points, size_t from,
                               size_t to, int vectors)
{
    size_t p;
    int i;

    memset(extent, 0, sizeof *extent);
#ifdef HILBERT__AVX2
    if (vectors && points->scalar == HILBERT_DOUBLE && points->dimension == 3 &&
        points->stride == 3 * sizeof(double) && to - from >= 8) {
        const double *xyz = (const double *)points->coordinates;
        extent->found = hilbert__fit_avx2(extent->box, xyz, from, to);
        if (extent->found) return;
    }
#else
    (void)vectors;
#endif
    for (p = from; p < to; p++) {
        hilbert__extent one;
        memset(&one, 0, sizeof one);
        one.found = 1;
        for (i = 0; i < points->dimension; i++) {
            one.box[i] = one.box[i + 3] = hilbert__coordinate(points, p, i);
            one.found &= hilbert__is_finite(one.box[i]);
        }
        one.bad = !one.found;
        hilbert__join_extents(extent, &one, points->dimension);
    }
}

/* ---- >>order  a small stable radix sort of (key, index) -- */
typedef struct hilbert__pair {
    uint64_t key;
    size_t   index;
} hilbert__pair;

/* LSD passes of 11 bits over the bits [low, high). Returns the array with the result, a or b. */
static hilbert__pair *hilbert__sort_bits(hilbert__pair *a, hilbert__pair *b, size_t count, int low,
                                         int high)
{
    for (; low < high; low += 11) {
        size_t start[2048], sum = 0, i;
        hilbert__pair *other = b;
        uint64_t mask = hilbert__low_bits(high - low < 11 ? high - low : 11), d;

        memset(start, 0, sizeof start);
        for (i = 0; i < count; i++) start[a[i].key >> low & mask]++;
        for (d = 0; d <= mask; d++) {
            size_t n = start[d];
            start[d] = sum;
            sum += n;
        }
        for (i = 0; i < count; i++) b[start[a[i].key >> low & mask]++] = a[i];
        b = a;
        a = other;
    }
    return a;
}

/* Insertion sort that gives up after too many moves; equal keys keep their order even then. Returns
 * whether a is sorted. */
static int hilbert__sort_nearly(hilbert__pair *a, size_t count)
{
    size_t budget = 4 * count, i, j;

    for (i = 1; i < count; i++) {
        hilbert__pair pair = a[i];
        for (j = i; j > 0 && a[j - 1].key > pair.key; j--) a[j] = a[j - 1];
        a[j] = pair;
        if (i - j > budget) return 0;
        budget -= i - j;
    }
    return 1;
}

/* Sorts a; b is scratch. Returns the array with the result, a or b. Sorts by as many high bits as
 * tell nearly all keys apart, then by insertion; if that does not do, by all bits that differ. */
static hilbert__pair *hilbert__sort(hilbert__pair *a, hilbert__pair *b, size_t count)
{
    uint64_t differ = 0;
    size_t i;
    int high = 0, enough = 6;
    hilbert__pair *sorted;

    for (i = 1; i < count; i++) differ |= a[i].key ^ a[0].key;
    while (high < 64 && differ >> high != 0) high++;
    for (i = count; i > 1; i >>= 1) enough++;
    enough = (enough + 10) / 11 * 11;
    if (enough >= high) return hilbert__sort_bits(a, b, count, 0, high);
    sorted = hilbert__sort_bits(a, b, count, high - enough, high);
    if (hilbert__sort_nearly(sorted, count)) return sorted;
    return hilbert__sort_bits(sorted, sorted == a ? b : a, count, 0, high);
}

/* ---- >>kd  a tree of medians -- */
/* The points of a node: values[] has one coordinate of each, order[] the index of each. */
typedef struct hilbert__selection {
    double *values;
    size_t *order;
} hilbert__selection;

static void hilbert__swap(hilbert__selection s, size_t i, size_t j)
{
    double v = s.values[i];
    size_t o = s.order[i];

    s.values[i] = s.values[j];
    s.order[i] = s.order[j];
    s.values[j] = v;
    s.order[j] = o;
}

/* Quickselect with three-way partitioning: brings to place k of [from, to) the value that sorting
 * would put there, with none greater before it and none smaller behind. The pivot is a median of
 * three, two of them from random places, so that no input is bad for long. */
static void hilbert__select(hilbert__selection s, size_t from, size_t to, size_t k)
{
    uint64_t random = 1;

    while (to - from > 1) {
        double a, b, c, pivot;
        size_t less = from, i = from, greater = to;

        random = random * UINT64_C(6364136223846793005) + 1442695040888963407u;
        a = s.values[from + (size_t)(random >> 33) % (to - from)];
        random = random * UINT64_C(6364136223846793005) + 1442695040888963407u;
        b = s.values[from + (size_t)(random >> 33) % (to - from)];
        c = s.values[from + (to - from) / 2];
        pivot = a < b ? (b < c ? b : a < c ? c : a) : (a < c ? a : b < c ? c : b);
        while (i < greater) {
            if (s.values[i] < pivot) hilbert__swap(s, i++, less++);
            else if (s.values[i] > pivot) hilbert__swap(s, i, --greater);
            else i++;
        }
        if (k < less) to = less;
        else if (k >= greater) from = greater;
        else return;
    }
}

/* Finds the splits of a node and of the nodes below it, for the points order[from..to). A split is
 * the smallest coordinate of the upper half; smaller ones go to the lower half. The recursion is
 * dimension*levels deep, 30 at most. */
static void hilbert__kd_split(hilbert_kd *kd, hilbert__selection s, const hilbert_points *points,
                              size_t node, int depth, size_t from, size_t to)
{
    size_t middle = from + (to - from) / 2, i;

    if (depth == kd->dimension * kd->levels) return;
    kd->splits[node] = 0;
    if (from < to) {
        double split;
        for (i = from; i < to; i++)
            s.values[i] = hilbert__coordinate(points, s.order[i], depth % kd->dimension);
        hilbert__select(s, from, to, middle);
        split = s.values[middle];
        kd->splits[node] = split + 0.0; /* -0 becomes 0: the order of the points does not matter */
        for (i = middle; i > from; i--) /* all that equal the split go to the upper half */
            if (s.values[i - 1] == split) hilbert__swap(s, i - 1, --middle);
    }
    hilbert__kd_split(kd, s, points, 2 * node + 1, depth + 1, from, middle);
    hilbert__kd_split(kd, s, points, 2 * node + 2, depth + 1, middle, to);
}

static uint64_t hilbert__kd_key(const hilbert_kd *kd, hilbert_curve curve, const double v[3])
{
    unsigned state = hilbert__start_state(curve, kd->dimension);
    uint64_t key = 0;
    size_t node = 0;
    int l, i;

    for (l = 0; l < kd->levels; l++) {
        unsigned o = 0, entry;
        for (i = 0; i < kd->dimension; i++) {
            unsigned up = v[i] >= kd->splits[node];
            node = 2 * node + 1 + up;
            o = o << 1 | up;
        }
        if (curve == HILBERT_CURVE_Z) {
            key = key << kd->dimension | o;
        } else if (kd->dimension == 3) {
            entry = hilbert__encode_table3[state][o];
            key = key << 3 | (entry & 7);
            state = entry >> 3;
        } else {
            entry = hilbert__encode_table2[state][o];
            key = key << 2 | (entry & 3);
            state = entry >> 2;
        }
    }
    return key;
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
    hilbert__extent part[HILBERT__MOST_PARTS], all;
    int parts, t, i;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if (!box || pts.scalar == HILBERT_UINT32) return HILBERT_ERROR_INVALID_ARGUMENT;
    parts = hilbert__num_parts(&opt);
    HILBERT__PARALLEL_FOR(parts)
    for (t = 0; t < parts; t++)
        hilbert__fit_range(&part[t], &pts, hilbert__share(pts.count, t, parts),
                           hilbert__share(pts.count, t + 1, parts), hilbert__vectors(&opt));
    all = part[0];
    for (t = 1; t < parts; t++) hilbert__join_extents(&all, &part[t], pts.dimension);
    memset(box, 0, sizeof *box);
    for (i = 0; all.found && i < pts.dimension; i++) {
        box->lo[i] = all.box[i];
        box->hi[i] = all.box[i + 3];
    }
    if (num_nonfinite) *num_nonfinite = all.bad;
    return all.found ? HILBERT_OK : HILBERT_ERROR_NO_FINITE_POINT;
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

/* The box that a NULL stands for: around the points, with cubic cells. */
static hilbert_result hilbert__default_box(hilbert_box *box, const hilbert_points *points,
                                           const hilbert_options *options)
{
    hilbert_result result;

    memset(box, 0, sizeof *box);
    if (points->scalar == HILBERT_UINT32) return HILBERT_OK;
    result = hilbert_box_fit(box, points, NULL, options);
    hilbert_box_cube(box);
    return result == HILBERT_ERROR_NO_FINITE_POINT ? HILBERT_OK : result;
}

HILBERT_API hilbert_result hilbert_keys(uint64_t *keys, const hilbert_points *points,
                                        const hilbert_box *box, size_t *num_nonfinite,
                                        const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    hilbert_box fitted;
    hilbert__grid grid;
    hilbert__steps steps;
    size_t bad[HILBERT__MOST_PARTS];
    int parts, vectors, by_steps, t;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if (pts.count != 0 && !keys) return HILBERT_ERROR_INVALID_ARGUMENT;
    if (!box) {
        result = hilbert__default_box(&fitted, points, options);
        if (result != HILBERT_OK) return result;
        box = &fitted;
    }
    result = hilbert__make_grid(&grid, box, pts.dimension, pts.dimension == 3 ? 21 : 32);
    if (result != HILBERT_OK) return result;
    parts = hilbert__num_parts(&opt);
    vectors = pts.dimension == 3 && pts.scalar != HILBERT_UINT32 ? hilbert__vectors(&opt) : 0;
    by_steps = !vectors && pts.count >= HILBERT__POINTS_FOR_STEPS;
    if (by_steps) hilbert__make_steps(&steps, &grid);
    HILBERT__PARALLEL_FOR(parts)
    for (t = 0; t < parts; t++)
        bad[t] = hilbert__keys_range(keys, &grid, &pts, by_steps ? &steps : NULL,
                                     hilbert__share(pts.count, t, parts),
                                     hilbert__share(pts.count, t + 1, parts), vectors);
    for (t = 1; t < parts; t++) bad[0] += bad[t];
    if (num_nonfinite) *num_nonfinite = bad[0];
    return HILBERT_OK;
}

HILBERT_API hilbert_result hilbert_keys_deep(hilbert_key128 *keys, const hilbert_points *points,
                                             const hilbert_box *box, size_t *num_nonfinite,
                                             const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    hilbert_box fitted;
    hilbert__grid grid;
    size_t bad[HILBERT__MOST_PARTS];
    int parts, t;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if (pts.dimension != 3 || pts.scalar == HILBERT_UINT32 || (pts.count != 0 && !keys))
        return HILBERT_ERROR_INVALID_ARGUMENT;
    if (!box) {
        result = hilbert__default_box(&fitted, points, options);
        if (result != HILBERT_OK) return result;
        box = &fitted;
    }
    result = hilbert__make_grid(&grid, box, 3, 42);
    if (result != HILBERT_OK) return result;
    parts = hilbert__num_parts(&opt);
    HILBERT__PARALLEL_FOR(parts)
    for (t = 0; t < parts; t++) {
        size_t p = hilbert__share(pts.count, t, parts),
               end = hilbert__share(pts.count, t + 1, parts);
        bad[t] = 0;
        for (; p < end; p++) keys[p] = hilbert__deep_key(&grid, &pts, p, &bad[t]);
    }
    for (t = 1; t < parts; t++) bad[0] += bad[t];
    if (num_nonfinite) *num_nonfinite = bad[0];
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

/* Pairs of keys and indices, those of points that are not finite after all others: in 2D at full
 * depth the last cell of the curve has their key, too. */
static void hilbert__fill_pairs(hilbert__pair *pairs, const uint64_t *keys,
                                const hilbert_points *pts, size_t num_nonfinite)
{
    size_t i, first = 0, last = pts->count - num_nonfinite;
    for (i = 0; i < pts->count; i++) {
        int finite = keys[i] != UINT64_MAX || hilbert__point_is_finite(pts, i);
        hilbert__pair *pair = &pairs[finite ? first++ : last++];
        pair->key = keys[i];
        pair->index = i;
    }
}

HILBERT_API hilbert_result hilbert_argsort(size_t *order, const hilbert_points *points,
                                           const hilbert_box *box, uint64_t *sorted_keys,
                                           const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    uint64_t *keys = NULL;
    hilbert__pair *pairs = NULL, *sorted;
    size_t count, num_nonfinite, i;
    hilbert_result result;

    result = hilbert__resolve_points(&pts, points);
    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    count = pts.count;
    if (count != 0 && !order) return HILBERT_ERROR_INVALID_ARGUMENT;
    if (count > SIZE_MAX / 2 / sizeof *pairs) return HILBERT_ERROR_TOO_LARGE;

    result = HILBERT_ERROR_OUT_OF_MEMORY;
    keys = (uint64_t *)hilbert__alloc_array(&opt.allocator, count, sizeof *keys);
    if (!keys) goto done;
    pairs = (hilbert__pair *)hilbert__alloc_array(&opt.allocator, count, 2 * sizeof *pairs);
    if (!pairs) goto done;
    result = hilbert_keys(keys, points, box, &num_nonfinite, options);
    if (result != HILBERT_OK) goto done;
    hilbert__fill_pairs(pairs, keys, &pts, num_nonfinite);
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
    if (pts.count == 0) return hilbert_argsort(order, points, box, NULL, options);
    if (!memory) return HILBERT_ERROR_INVALID_ARGUMENT;
    if (pts.count > SIZE_MAX / pts.stride) return HILBERT_ERROR_TOO_LARGE;

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

HILBERT_API hilbert_result hilbert_kd_build(hilbert_kd *kd, const hilbert_points *points,
                                            int levels, const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    hilbert__selection s = {NULL, NULL};
    double *splits = NULL;
    size_t num_finite = 0, p;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if (!kd || pts.scalar == HILBERT_UINT32 || levels < 1 ||
        levels > (pts.dimension == 3 ? 10 : 15))
        return HILBERT_ERROR_INVALID_ARGUMENT;
    if (pts.count > SIZE_MAX / 16) return HILBERT_ERROR_TOO_LARGE;

    result = HILBERT_ERROR_OUT_OF_MEMORY;
    splits = (double *)hilbert__alloc_array(&opt.allocator, (size_t)1 << (pts.dimension * levels),
                                            sizeof *splits);
    if (!splits) goto done;
    s.values = (double *)hilbert__alloc_array(&opt.allocator, pts.count, sizeof *s.values);
    if (!s.values) goto done;
    s.order = (size_t *)hilbert__alloc_array(&opt.allocator, pts.count, sizeof *s.order);
    if (!s.order) goto done;
    for (p = 0; p < pts.count; p++)
        if (hilbert__point_is_finite(&pts, p)) s.order[num_finite++] = p;
    kd->splits = splits;
    kd->dimension = pts.dimension;
    kd->levels = levels;
    hilbert__kd_split(kd, s, &pts, 0, 0, 0, num_finite);
    splits = NULL;
    result = HILBERT_OK;

done:
    hilbert__release(&opt.allocator, s.order);
    hilbert__release(&opt.allocator, s.values);
    hilbert__release(&opt.allocator, splits);
    return result;
}

HILBERT_API hilbert_result hilbert_kd_keys(uint64_t *keys, const hilbert_points *points,
                                           const hilbert_kd *kd, hilbert_curve curve,
                                           size_t *num_nonfinite, const hilbert_options *options)
{
    hilbert_options opt;
    hilbert_points pts;
    size_t bad[HILBERT__MOST_PARTS];
    int parts, t;
    hilbert_result result = hilbert__resolve_points(&pts, points);

    if (result == HILBERT_OK) result = hilbert__resolve(&opt, options, pts.count);
    if (result != HILBERT_OK) return result;
    if ((pts.count != 0 && !keys) || !kd || !kd->splits || kd->dimension != pts.dimension ||
        pts.scalar == HILBERT_UINT32 || (unsigned)curve > (unsigned)HILBERT_CURVE_Z)
        return HILBERT_ERROR_INVALID_ARGUMENT;
    parts = hilbert__num_parts(&opt);
    HILBERT__PARALLEL_FOR(parts)
    for (t = 0; t < parts; t++) {
        size_t p = hilbert__share(pts.count, t, parts),
               end = hilbert__share(pts.count, t + 1, parts);
        bad[t] = 0;
        for (; p < end; p++) {
            double v[3] = {0, 0, 0};
            int i, finite = 1;
            for (i = 0; i < pts.dimension; i++) {
                v[i] = hilbert__coordinate(&pts, p, i);
                finite &= hilbert__is_finite(v[i]);
            }
            keys[p] = finite ? hilbert__kd_key(kd, curve, v) : UINT64_MAX;
            bad[t] += !finite;
        }
    }
    for (t = 1; t < parts; t++) bad[0] += bad[t];
    if (num_nonfinite) *num_nonfinite = bad[0];
    return HILBERT_OK;
}

HILBERT_API void hilbert_kd_free(hilbert_kd *kd, const hilbert_options *options)
{
    hilbert_options opt;
    double *splits;

    if (!kd || hilbert__resolve(&opt, options, 0) != HILBERT_OK) return;
    splits = kd->splits;
    memset(kd, 0, sizeof *kd);
    hilbert__release(&opt.allocator, splits);
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
    if (parts[i].start == parts[0].start) { /* all parts begin at one key: the last has it all */
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
