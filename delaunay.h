/* delaunay.h - v0.1.0 - exact 3D Delaunay triangulation, and the engine of mesher.h and spr.h
 *
 *     #define DELAUNAY_IMPLEMENTATION      // in one file of your program
 *     #include "delaunay.h"                // needs hilbert.h and hxtsort.h beside it
 *     #include <stdio.h>
 *
 *     int main(void)
 *     {
 *         double xyz[] = {0,0,0, 1,0,0, 0,1,0, 0,0,1, 1,1,1};
 *         delaunay_mesh mesh = {0};
 *         if (delaunay_tetrahedralize(&mesh, xyz, 5, NULL, NULL) != DELAUNAY_OK) return 1;
 *         printf("%lu tetrahedra\n", (unsigned long)delaunay_count_tets(&mesh));
 *         delaunay_mesh_free(&mesh);
 *         return 0;
 *     }
 *
 *     cc -O3 -fopenmp program.c -o program -lm      (also without -fopenmp: one thread)
 *
 * CONTENTS (search for the tag)
 *   >>dependencies    how this file finds hilbert.h and hxtsort.h
 *   >>types           status codes, host, mesh object, options, reports
 *   >>everyday        points in, tetrahedra out
 *   >>expert          predicates, editing, closure search, the two engines
 *   >>memory          every allocation goes through here
 *   >>predicates      orient3d and inSphere, exact; the symbolic perturbation
 *   >>mesh            the mesh object
 *   >>insertion       walk, cavity, ball                         [Marot 2020, 3.3-3.7]
 *   >>build           order of insertion, duplicates
 *   >>numbering       the same slots for any number of threads
 *   >>import          a mesh from arrays
 *   >>partitions      engine (a): sections of the Moore curve    [Marot 2020, 4.2-4.6]
 *   >>editing         stars, replacement of a cavity, constraint marks, locate
 *   >>changing        insertion and removal of points in a finished triangulation
 *   >>queries         hull, Voronoi cells, alpha values, nearest vertex
 *   >>reconnect       closure search over small polyhedra        [Marot 2020, 6.2]
 *   >>speculate       engine (b): plan on a frozen mesh, reserve, commit
 *   >>validate        a validator that takes nothing for granted
 *   >>public          the everyday functions
 *
 * WHAT IT DOES NOT DO: constraints (see mesher.h), quality improvement (see spr.h), 2D meshes. A
 * thread needs up to 60 KB of stack.
 *
 * HOW IT WORKS
 *   A mesh is two arrays. vertices[0] is the ghost, the vertex at infinity that closes the hull
 *   [Marot 2020, 3.7]; the caller's points become vertices 1 .. num_vertices-1, in their order of
 *   insertion: in rounds, each along a Moore curve (a closed Hilbert curve). tets[0] is a dummy, so
 *   that handle 0 means "none". The index of a tetrahedron in tets is its slot. A tetrahedron is a
 *   record of four vertices and four handles: the handle 4*t+i names facet i of tetrahedron t, the
 *   one opposite its vertex i, and tets[t].n[i] is the handle of the same facet in the neighbouring
 *   tetrahedron. In outward order (counterclockwise seen from outside) the local vertices of the
 *   facets are {1,2,3} {0,3,2} {0,1,3} {0,2,1}.
 *   The determinant det(b-a, c-a, d-a) of a tetrahedron (a,b,c,d) is positive. A ghost tetrahedron
 *   has the ghost as its last vertex; its other vertices (a,b,c) are a hull facet, in the order in
 *   which (a,b,c,q) is positive for every point q beyond it. A deleted tetrahedron has v[0] == 0.
 *   Ties between cospherical points are broken by a symbolic perturbation of the lifting, in
 *   lexicographic order of the coordinates. So the triangulation depends on the set of points
 *   alone, not on their order or on the number of threads.
 *
 * COMPILE-TIME SWITCHES
 *   DELAUNAY_IMPLEMENTATION   implementation file  compile the bodies, also of hilbert.h, hxtsort.h
 *   DELAUNAY_NO_DEPENDENCIES  implementation file  not those two: another file compiles them
 *   DELAUNAY_STATIC           implementation file  make everything static
 *   DELAUNAY_NO_SIMD          implementation file  use plain C only; same results
 *   DELAUNAY_INDEX64          whole program        64-bit handles: more than 2^30 tetrahedra
 *
 * SOURCES
 *   [Amenta 2003]    N. Amenta, S. Choi, G. Rote, Incremental constructions con BRIO, Symposium on
 *                    Computational Geometry
 *   [Dekker 1971]    T. J. Dekker, A floating-point technique for extending the available
 *                    precision, Numerische Mathematik 18
 *   [Marot 2020]     C. Marot, Parallel tetrahedral mesh generation, thesis
 *   [Shewchuk 1997]  J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust
 *                    geometric predicates, Discrete & Computational Geometry 18
 *
 * LICENCE: MIT or public domain, at the end of the file.
 * SPDX-License-Identifier: MIT OR Unlicense
 */

/* ---- >>dependencies (outside the guard: a second include may ask for bodies) -------------- */
#if defined(DELAUNAY_IMPLEMENTATION) && !defined(DELAUNAY_NO_DEPENDENCIES)
#  ifndef HILBERT_IMPLEMENTATION
#    define HILBERT_IMPLEMENTATION
#  endif
#  ifndef HXTSORT_IMPLEMENTATION
#    define HXTSORT_IMPLEMENTATION
#  endif
#endif
#if defined(DELAUNAY_STATIC) && !defined(HILBERT_H)
#  define HILBERT_STATIC
#endif
#if defined(DELAUNAY_STATIC) && !defined(HXTSORT_H)
#  define HXTSORT_STATIC
#endif
#include "hilbert.h"
#include "hxtsort.h"
#if HILBERT_VERSION < 100 || HXTSORT_VERSION < 100
#  error "delaunay.h needs hilbert.h and hxtsort.h 0.1.0 or newer"
#endif

#ifndef DELAUNAY_H
#define DELAUNAY_H
#define DELAUNAY_VERSION 100 /* 10000*major + 100*minor + patch */

#include <stddef.h>
#include <stdint.h>
#include <float.h>

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(_M_FP_FAST) ||              \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#  error "delaunay.h needs IEEE arithmetic: no -ffast-math, -fassociative-math, -ffinite-math-only"
#endif
/* Values 0, 1 and 16 round the result of every operation on doubles to double. (16 is C23's, on
 * processors with half precision, and differs from 0 for that type only.) */
#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 1 &&                    \
    FLT_EVAL_METHOD != 16
#  error "delaunay.h: exact predicates need doubles, no excess precision (x87: -mfpmath=sse)"
#endif

#ifndef DELAUNAY_API
#  if !defined(DELAUNAY_STATIC)
#    define DELAUNAY_API extern
#  elif defined(__GNUC__)
#    define DELAUNAY_API static __attribute__((unused))
#  else
#    define DELAUNAY_API static
#  endif
#endif
#if defined(__GNUC__)
#  define DELAUNAY_INLINE static inline __attribute__((unused))
#else
#  define DELAUNAY_INLINE static inline
#endif

/* Files compiled with and without DELAUNAY_INDEX64 have different layouts and must not link
 * silently: the functions that create, free or keep a mesh have different names. */
#ifdef DELAUNAY_INDEX64
#  define delaunay_tetrahedralize        delaunay_tetrahedralize_index64
#  define delaunay_tetrahedralize_points delaunay_tetrahedralize_points_index64
#  define delaunay_insert                delaunay_insert_index64
#  define delaunay_import                delaunay_import_index64
#  define delaunay_reserve               delaunay_reserve_index64
#  define delaunay_mesh_free             delaunay_mesh_free_index64
#  define delaunay_editor_new            delaunay_editor_new_index64
#  define delaunay_engine_new            delaunay_engine_new_index64
#  define delaunay_engine_new_lent       delaunay_engine_new_lent_index64
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- >>types ------------------------------------------------------------------------------ */

/* 0: success. Positive: the mesh is valid, but a goal was not met or the caller's budget ran out.
 * Negative: failure. -1..-15 mean the same in every header of this family, so that a result of one
 * header can be cast to the result type of another. */
typedef enum delaunay_result {
    DELAUNAY_OK                       = 0,
    DELAUNAY_STOPPED_BY_BUDGET        = 1,  /* valid; the caller's done() stopped the call */
    DELAUNAY_GOAL_NOT_MET             = 2,  /* valid; for other headers, which say which goal */
    DELAUNAY_ERROR_INVALID_ARGUMENT   = -1,
    DELAUNAY_ERROR_OUT_OF_MEMORY      = -2,
    DELAUNAY_CANCELLED                = -3,
    DELAUNAY_ERROR_TOO_LARGE          = -4, /* a count beyond what the indices can hold */
    DELAUNAY_ERROR_INTERNAL           = -5, /* an internal check failed: please report it */
    DELAUNAY_ERROR_DIMENSION          = -48, /* the points do not span 3D: report->dimension */
    DELAUNAY_ERROR_NOT_FINITE         = -49, /* NaN or infinity: report->ids */
    DELAUNAY_ERROR_INVALID_MESH       = -51, /* a defect of the mesh: see the report */
    DELAUNAY_ERROR_BROKEN_ARITHMETIC  = -52  /* the self-test failed: compiler flags or FPU mode */
} delaunay_result;

/* {alloc, release, user}; all zero: malloc and free. */
typedef hxtsort_allocator delaunay_allocator;

enum { DELAUNAY_LOG_ERROR, DELAUNAY_LOG_WARNING, DELAUNAY_LOG_INFO, DELAUNAY_LOG_DEBUG };

/* What the host program provides for a call; all zeros is the recommended setting.
 * The allocator is called by one thread at a time: the calling thread or a worker thread. The other
 * callbacks are called by the calling thread only. Every callback of these headers must return: no
 * C++ exception and no longjmp may leave it; to stop a call, progress returns nonzero. */
typedef struct delaunay_host {
    delaunay_allocator allocator;
    size_t             memory_limit_bytes;  /* 0: none. Beyond it allocations fail. It applies to
                                             * each object (a mesh, a domain, the working memory of
                                             * a call) by itself. A mesh keeps the allocator that it
                                             * was made with; delaunay_insert and spr_improve put
                                             * their limit in place of its own; the two engines take
                                             * memory from the mesh alone, within its limit */
    int                num_threads;         /* 0: omp_get_max_threads() at each call; more than 1024
                                             * count as 1024. Negative: functions that make
                                             * something refuse it, to the others it is 0 */
    /* NULL: silent. So far mesher.h alone has warnings and, for debugging, what it does */
    void (*log)(void *user, int level, const char *text);
    /* phase: what is being done, in a word or two, such as "insert" (delaunay.h), "intersections",
     * "empty mesh", "recover", "regions", "size", "refine" (mesher.h), "improve" (spr.h). fraction:
     * how much of the phase is done, negative if unknown, as it is for "refine"; a phase need not
     * end with 1. A nonzero result cancels */
    int  (*progress)(void *user, const char *phase, double fraction);
    double (*clock)(void *user);            /* seconds; NULL: omp_get_wtime(), else clock() */
    void              *user;
} delaunay_host;

/* The account of one object's allocations; zeroed: malloc and free, no limit. Used directly only by
 * callers of delaunay_alloc and its companions. */
typedef struct delaunay_memory {
    delaunay_allocator allocator; /* the host's, or the default one */
    size_t             limit_bytes, bytes, peak_bytes;
} delaunay_memory;

#ifdef DELAUNAY_INDEX64
typedef uint64_t delaunay_handle; /* a tetrahedron t, or one of its facets 4*t+i */
#else
typedef uint32_t delaunay_handle;
#endif

#define DELAUNAY_GHOST      0u          /* the vertex at infinity */
#define DELAUNAY_NONE       0u          /* no tetrahedron, no facet */
#define DELAUNAY_NO_ID      UINT32_MAX  /* id of a vertex that is none of the caller's points */
#define DELAUNAY_OUTSIDE    0u          /* colour of tetrahedra outside every region */

typedef struct delaunay_vertex {
    double   x[3];
    uint32_t key;   /* scratch of the running stage: in engine (a) the top bits of the Moore key */
    uint32_t local; /* scratch of the running stage: a number within a cavity */
} delaunay_vertex;

typedef struct delaunay_tet {
    uint32_t        v[4]; /* vertices; v[3] == 0: ghost tetrahedron; v[0] == 0: deleted */
    delaunay_handle n[4]; /* n[i]: the handle of facet i in the neighbour; 0: no neighbour */
} delaunay_tet;

/* Bits of delaunay_mesh.flags[t]. The two tetrahedra at a facet have the same bit for it, and so
 * have all tetrahedra around an edge. */
#define DELAUNAY_FACET_BIT(i)  (1u << (i))         /* facet i is constrained */
#define DELAUNAY_FACET_BITS    0xfu
#define DELAUNAY_EDGE_BIT(e)   (1u << (4 + (e)))   /* edge e, of (01)(02)(03)(12)(13)(23) */
#define DELAUNAY_EDGE_BITS     0x3f0u
#define DELAUNAY_STAGE_BITS    0xfc00u             /* for the running stage; 0 in new tetrahedra */

/* The mesh object. Its arrays are public: read them directly. Zero-initialise before first use.
 * Any call that may add vertices or tetrahedra may move the arrays. */
typedef struct delaunay_mesh {
    delaunay_vertex *vertices;     /* [0] is the ghost */
    uint32_t        *vertex_id;    /* index of the caller's point; DELAUNAY_NO_ID: a vertex that was
                                      added later */
    double          *weight;       /* of each vertex; NULL: not a weighted triangulation */
    delaunay_handle *vertex_tet;   /* a tetrahedron at each vertex, 0: in none; NULL until
                                      delaunay_link_vertices */
    uint32_t         num_vertices; /* including the ghost */
    uint32_t         cap_vertices;

    delaunay_tet    *tets;         /* [0] is a dummy */
    uint16_t        *flags;        /* constraint and stage bits; NULL until delaunay_enable_marks */
    uint32_t        *color;        /* region; NULL until delaunay_enable_marks */
    uint8_t         *mark;         /* scratch of the insertion; 0 between calls */
    delaunay_handle  num_tets;     /* slots in use, including the dummy and deleted ones */
    delaunay_handle  cap_tets;
    delaunay_handle *free_tets;    /* deleted slots, last in first out */
    delaunay_handle  num_free;
    delaunay_handle  cap_free;

    uint32_t        *vertex_of;    /* caller's point -> vertex; equal points have the same vertex;
                                      0: hidden by weights, in no tetrahedron. An editor does not
                                      change it */
    uint32_t         num_points;   /* length of vertex_of */

    delaunay_memory  memory;
} delaunay_mesh;

typedef struct delaunay_options {
    delaunay_host host;
    int any_order; /* nonzero: tetrahedra stay in the slots where they were made, in no canonical
                    * order (faster) */
} delaunay_options;

/* What happened and where. Every function that takes a report overwrites all of it. */
typedef struct delaunay_report {
    uint64_t num_points, num_vertices;      /* of the mesh */
    uint64_t num_duplicates;                /* points beyond the first one at each place; after
                                             * delaunay_insert of this call's only */
    uint64_t num_tets, num_ghosts;
    uint64_t num_hidden;                    /* vertices that weights keep out of all tetrahedra */
    int      dimension;                     /* affine dimension of the points; -1: no points, an
                                             * import without tetrahedra, or not known, as there
                                             * was an error before */
    uint32_t ids[4]; int num_ids;           /* what is wrong: point ids; in the validator slots
                                             * (the second may be one that does not exist); in
                                             * delaunay_import also indices of tetrahedra */
    double   xyz[3];                        /* where */
    double   seconds_sort, seconds_insert, seconds_finish;
    size_t   peak_bytes;
    char     message[256];                  /* a sentence; empty on success */
} delaunay_report;

/* ---- >>everyday --------------------------------------------------------------------------- */

/* A constant sentence for any status of this header. */
DELAUNAY_API const char *delaunay_result_string(delaunay_result result);

/* Delaunay triangulation of a set of points.
 *
 *   mesh     in/out  zeroed, or a mesh to be replaced. On failure it is freed and zeroed, except
 *                    that _ERROR_INVALID_ARGUMENT leaves it as it was
 *   xyz      in      3*count doubles, finite, of any magnitude; not kept
 *   count    in      at most 2^32 - 18; with 32-bit handles about 150 million
 *   options  in      NULL or zeroed: defaults
 *   report   out     may be NULL
 *
 * Returns  DELAUNAY_OK; _ERROR_DIMENSION: fewer than 4 affinely independent points
 *          (report->dimension); _ERROR_NOT_FINITE with ids; _ERROR_TOO_LARGE: see count, and
 *          DELAUNAY_INDEX64; _ERROR_OUT_OF_MEMORY; _ERROR_INVALID_ARGUMENT; _CANCELLED
 * Threads  options->host.num_threads; calls on distinct meshes may run at the same time
 * Repeats  same bytes for the same points in the same order, with any number of threads. With
 *          options->any_order only the triangulation is the same, not the order of the slots
 * Source   Marot 2020, chapters 3 and 4
 */
DELAUNAY_API delaunay_result delaunay_tetrahedralize(delaunay_mesh *mesh, const double *xyz,
                                                     size_t count, const delaunay_options *options,
                                                     delaunay_report *report);

/* Points in the layout of the caller's memory. Zero the members that are not needed. */
typedef struct delaunay_points {
    const void *xyz;     /* the first point: three adjacent coordinates */
    size_t      count;
    size_t      stride;  /* bytes from one point to the next; 0: packed */
    int         is_float; /* nonzero: coordinates and weights are float, not double */
    const void *weights; /* NULL: none. Squared radii of spheres; may be negative */
    size_t      weight_stride; /* bytes; 0: packed */
} delaunay_points;

/* The same as delaunay_tetrahedralize, for points in any layout, and with weights: the regular
 * triangulation, dual to the power diagram. A tetrahedron's sphere is the one that is orthogonal to
 * the spheres of its vertices; no other point has a power with respect to it below that point's
 * weight. Points that are in no tetrahedron are hidden (mesh->vertex_of is 0). Of several points at
 * one place the one with the greatest weight counts. Equal weights give the Delaunay triangulation.
 * The result is exact, and ties are broken as in delaunay_tetrahedralize. A weighted mesh cannot be
 * edited by delaunay_insert or a delaunay_editor. Points and weights that are not packed doubles
 * are copied while they are sorted. */
DELAUNAY_API delaunay_result delaunay_tetrahedralize_points(delaunay_mesh *mesh,
                                                            const delaunay_points *points,
                                                            const delaunay_options *options,
                                                            delaunay_report *report);

/* Inserts points into a finished triangulation, which becomes the triangulation of all points.
 *
 *   mesh     in/out  a result of delaunay_tetrahedralize, or zeroed; without marks
 *                    (delaunay_enable_marks). On failure it is still a triangulation, of the old
 *                    points and perhaps some of the new ones. To go on, call again with the same
 *                    points: those that are missing are inserted then (if num_points has grown
 *                    already, all of them are counted a second time)
 *   xyz      in      3*count doubles, finite; not kept. Their ids continue from mesh->num_points
 *
 * New vertices follow the old ones. A point equal to a vertex maps to that vertex, and puts it back
 * into the triangulation if it was in no tetrahedron (delaunay_editor_remove).
 * Returns  as delaunay_tetrahedralize; _ERROR_INVALID_ARGUMENT also for a mesh that has no hull, or
 *          has weights or marks
 * Cost     O(count log count), and one pass over the mesh; for a few points use a delaunay_editor
 * Threads  options->host.num_threads; calls on distinct meshes may run at the same time. The
 *          allocator is the mesh's, not the host's; the memory limit is the host's, from now on
 * Repeats  same bytes for the same mesh and points, with any number of threads; with
 *          options->any_order as in delaunay_tetrahedralize
 */
DELAUNAY_API delaunay_result delaunay_insert(delaunay_mesh *mesh, const double *xyz, size_t count,
                                             const delaunay_options *options,
                                             delaunay_report *report);

/* Frees all arrays and zeroes the object. Accepts a zeroed one. */
DELAUNAY_API void delaunay_mesh_free(delaunay_mesh *mesh);

/* Number of real tetrahedra: neither ghost nor deleted; 0 if the mesh is NULL. O(slots). */
DELAUNAY_API uint64_t delaunay_count_tets(const delaunay_mesh *mesh);

/* Writes the real tetrahedra, in the order of their slots, each as four ids of the caller's points.
 * Returns their number; only the first cap_tets of them are written. tets may be NULL, to count.
 * Vertices with DELAUNAY_NO_ID get ids from num_points on, in order. */
DELAUNAY_API uint64_t delaunay_export_tets(const delaunay_mesh *mesh, uint32_t *tets,
                                           uint64_t cap_tets);

/* Levels of delaunay_validate; each includes those before it. A greater number counts as the last
 * level; a negative one checks nothing. */
enum {
    DELAUNAY_VALIDATE_TOPOLOGY,   /* neighbours have each other's handles, their facets match, none
                                   * is deleted, and their marks agree */
    DELAUNAY_VALIDATE_GEOMETRY,   /* corners are finite, every real tetrahedron is positive, and the
                                   * hull, if the mesh has one, is convex; exact tests */
    DELAUNAY_VALIDATE_DELAUNAY    /* every facet is locally Delaunay, ties broken by the
                                   * perturbation, and so a mesh with its hull is Delaunay */
};
/* Proves what the level lists, or returns DELAUNAY_ERROR_INVALID_MESH and reports the first defect,
 * which does not depend on the number of threads. delaunay_validate uses one thread,
 * delaunay_validate_on those of the host (NULL: all). Only reads the mesh. Cost: about 0.1
 * microseconds for each tetrahedron and level. */
DELAUNAY_API delaunay_result delaunay_validate(const delaunay_mesh *mesh, int level,
                                               delaunay_report *report);
DELAUNAY_API delaunay_result delaunay_validate_on(const delaunay_mesh *mesh, int level,
                                                  const delaunay_host *host,
                                                  delaunay_report *report);

/* ---- >>expert ------------------------------------------------------------------------------
 * What mesher.h and spr.h are built on. The names are stable, but few arguments are checked. */

/* -- memory: overflow-checked, counted, 64-byte aligned; NULL on failure. release accepts NULL. */
DELAUNAY_API delaunay_result delaunay_memory_init(delaunay_memory *memory,
                                                  const delaunay_host *host);
DELAUNAY_API void *delaunay_alloc(delaunay_memory *memory, size_t count, size_t size);
/* All bits zero. With the default allocator memory that is never touched costs nothing. */
DELAUNAY_API void *delaunay_alloc_zeroed(delaunay_memory *memory, size_t count, size_t size);
/* A block of count elements, of which the first keep are those of old. old is released; on failure
 * it is untouched. */
DELAUNAY_API void *delaunay_grow(delaunay_memory *memory, void *old, size_t keep, size_t count,
                                 size_t size);
/* The same, with all other elements zero. */
DELAUNAY_API void *delaunay_grow_zeroed(delaunay_memory *memory, void *old, size_t keep,
                                        size_t count, size_t size);
DELAUNAY_API void  delaunay_release(delaunay_memory *memory, void *block);
/* Seconds by the host's clock, from any origin: only differences have a meaning. */
DELAUNAY_API double delaunay_seconds(const delaunay_host *host);
/* The greatest number of threads that a call with this host uses. */
DELAUNAY_API int delaunay_threads(const delaunay_host *host); /* 1024 at most */
/* Threads for a loop of so many short steps: one if they are few, for on a busy machine the others
 * wake late; else delaunay_threads. */
DELAUNAY_API int delaunay_threads_for(const delaunay_host *host, size_t steps);
/* CPU seconds of the calling thread; 0 where there is no such clock. */
DELAUNAY_API double delaunay_cpu_seconds(void);

/* -- a crew: how many threads a loop is to use. Threads that share a loop all wait at its end for
 * the last of them, and where other programs use the processors, that one may be away for
 * milliseconds. A stage with many short loops asks a crew before each loop how many threads to use,
 * and tells it afterwards the work done, in CPU seconds of all threads together. If a loop took
 * longer than its work would have taken one thread, the loops that follow get one thread, for ten
 * times the time lost (not if the host has a clock of its own). Results must not depend on it.
 * Before the first loop it must be zeroed, except for the host. */
typedef struct delaunay_crew {
    const delaunay_host *host;
    double               begin, alone_until; /* by the host's clock */
    int                  threads;
} delaunay_crew;
/* The number of threads for the next loop; worthwhile: 0 if it is too short to be shared. */
DELAUNAY_API int  delaunay_crew_begin(delaunay_crew *crew, int worthwhile);
DELAUNAY_API void delaunay_crew_end(delaunay_crew *crew, double work);

/* -- predicates. Points are three doubles. Signs are exact: -1, 0, 1. */

/* The exact tests without the fast floating-point filters: slower; for any finite doubles. */
DELAUNAY_API int delaunay_orient3d_exact(const double *a, const double *b, const double *c,
                                         const double *d);
DELAUNAY_API int delaunay_insphere_exact(const double *a, const double *b, const double *c,
                                         const double *d, const double *e);
/* Sign of det(b-a, c-a, d-a): positive for a valid tetrahedron (a,b,c,d).
 * Filter: the sign is certain if |det| is greater than 7 eps times the permanent [Shewchuk 1997],
 * which is at most 1.16 |b-a||c-a||d-a|. The limits on the lengths keep every product away from
 * overflow and underflow. Fused multiply-adds only make the result more accurate. */
DELAUNAY_INLINE int delaunay_orient3d(const double *a, const double *b, const double *c,
                                      const double *d)
{
    double bx = b[0] - a[0], by = b[1] - a[1], bz = b[2] - a[2];
    double cx = c[0] - a[0], cy = c[1] - a[1], cz = c[2] - a[2];
    double dx = d[0] - a[0], dy = d[1] - a[1], dz = d[2] - a[2];
    double det = bx * (cy * dz - cz * dy) + by * (cz * dx - cx * dz) + bz * (cx * dy - cy * dx);
    double lb = bx * bx + by * by + bz * bz, lc = cx * cx + cy * cy + cz * cz;
    double ld = dx * dx + dy * dy + dz * dz;
    double low = lb < lc ? lb : lc, high = lb > lc ? lb : lc; /* no branches */
    low = low < ld ? low : ld;
    high = high > ld ? high : ld;
    if (det * det > 2e-30 * lb * lc * ld && low > 1e-90 && high < 1e100)
        return (det > 0) - (det < 0);
    return delaunay_orient3d_exact(a, b, c, d);
}
/* Positive: e inside the sphere through the positive tetrahedron (a,b,c,d). */
DELAUNAY_API int delaunay_insphere(const double *a, const double *b, const double *c,
                                   const double *d, const double *e);
/* The same, with ties broken by the symbolic perturbation: never 0 for five distinct points. */
DELAUNAY_API int delaunay_insphere_perturbed(const double *a, const double *b, const double *c,
                                             const double *d, const double *e);
/* The same with weights of a, b, c, d, e, where the lifting is |x|^2 - w instead of |x|^2: positive
 * if the power of e with respect to the sphere orthogonal to those of a, b, c, d is less than the
 * weight of e. With equal weights this is delaunay_insphere. */
DELAUNAY_API int delaunay_insphere_weighted(const double *a, const double *b, const double *c,
                                            const double *d, const double *e,
                                            const double *weights);
/* The same, with ties broken by the symbolic perturbation: never 0 for five distinct points. */
DELAUNAY_API int delaunay_insphere_weighted_perturbed(const double *a, const double *b,
                                                      const double *c, const double *d,
                                                      const double *e, const double *weights);
/* Sign of one component (axis: 0, 1, 2) of the cross product (b-a) x (c-a): the orientation of a,
 * b, c projected to the coordinate plane with that normal. */
DELAUNAY_API int delaunay_orient2d(const double *a, const double *b, const double *c, int axis);
/* True if a, b, c lie on one line, exactly. */
DELAUNAY_API int delaunay_collinear(const double *a, const double *b, const double *c);
/* Returns DELAUNAY_OK; DELAUNAY_ERROR_BROKEN_ARITHMETIC under compiler flags or FPU modes that
 * break exactness (rounding, flushing to zero, excess precision, reordered sums: clang does not
 * tell this header of -fassociative-math and -funsafe-math-optimizations alone); _OUT_OF_MEMORY.
 * Takes less than a millisecond. Call it in the thread that will triangulate: each thread has FPU
 * modes of its own. */
DELAUNAY_API delaunay_result delaunay_selftest(void);

/* -- mesh object */

/* Makes room for so many vertices and tetrahedra (totals, including the ghost and the dummy); may
 * move the arrays. */
DELAUNAY_API delaunay_result delaunay_reserve(delaunay_mesh *mesh, size_t vertices, size_t tets);
/* Allocates flags and color, all zero: tetrahedra are DELAUNAY_OUTSIDE until they are coloured. */
DELAUNAY_API delaunay_result delaunay_enable_marks(delaunay_mesh *mesh);
/* Allocates vertex_tet and fills it. From then on delaunay_replace keeps it up to date. */
DELAUNAY_API delaunay_result delaunay_link_vertices(delaunay_mesh *mesh);
/* Appends a vertex with the given id; returns its index, 0 when out of memory. Not yet in any
 * tetrahedron. */
DELAUNAY_API uint32_t delaunay_add_vertex(delaunay_mesh *mesh, const double *xyz, uint32_t id);
/* Makes a mesh from arrays, which may come from another program. tets holds 4 indices into xyz for
 * each tetrahedron; these are all positive as defined above, or all negative (then they are
 * reversed). A facet that has just one tetrahedron gets no neighbour, handle 0. colors may be NULL.
 * Returns  DELAUNAY_OK; _ERROR_INVALID_ARGUMENT: an index out of range, or NULL with a count that
 *          is not 0; _NOT_FINITE: NaN or infinity, report->ids are up to four such points, in a
 *          tetrahedron or not; _TOO_LARGE; _OUT_OF_MEMORY; _INVALID_MESH: a flat tetrahedron, both
 *          orientations, more than two tetrahedra at a facet, or two on the same side of it:
 *          report->ids[0] is the tetrahedron. Other overlaps are not detected. On failure the mesh
 *          is zeroed, except that it stays as it was if an argument is NULL or a count is too
 *          large */
DELAUNAY_API delaunay_result delaunay_import(delaunay_mesh *mesh, const double *xyz,
                                             size_t num_points, const uint32_t *tets,
                                             const uint32_t *colors, size_t num_tets,
                                             const delaunay_host *host, delaunay_report *report);
/* Removes deleted slots, and puts the vertices of each tetrahedron and the slots into canonical
 * order, which depends on the triangulation and the vertex numbers alone: the same bytes for any
 * number of threads. Real tetrahedra come first, then the ghosts. */
DELAUNAY_API delaunay_result delaunay_canonicalize(delaunay_mesh *mesh, const delaunay_host *host);

DELAUNAY_INLINE int delaunay_is_deleted(const delaunay_mesh *mesh, delaunay_handle t)
{
    return mesh->tets[t].v[0] == 0;
}
DELAUNAY_INLINE int delaunay_is_ghost(const delaunay_mesh *mesh, delaunay_handle t)
{
    return mesh->tets[t].v[3] == DELAUNAY_GHOST;
}
/* Vertices of facet i of a tetrahedron, outward order. */
static const uint8_t delaunay_facet_vertices[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
/* Vertices of edge e; delaunay_edge_of[i][j] is the edge between local vertices i and j. */
static const uint8_t delaunay_edge_vertices[6][2] = {{0, 1}, {0, 2}, {0, 3},
                                                     {1, 2}, {1, 3}, {2, 3}};
static const uint8_t delaunay_edge_of[4][4] = {
    {9, 0, 1, 2}, {0, 9, 3, 4}, {1, 3, 9, 5}, {2, 4, 5, 9}};
DELAUNAY_INLINE const uint8_t *delaunay_facet_order(int i) { return delaunay_facet_vertices[i]; }
DELAUNAY_INLINE const uint8_t *delaunay_edge_order(int e) { return delaunay_edge_vertices[e]; }
DELAUNAY_INLINE int delaunay_edge_between(int i, int j) { return delaunay_edge_of[i][j]; }
/* Local index of vertex v in tetrahedron t, or -1. */
DELAUNAY_INLINE int delaunay_local_index(const delaunay_tet *t, uint32_t v)
{
    return t->v[0] == v ? 0 : t->v[1] == v ? 1 : t->v[2] == v ? 2 : t->v[3] == v ? 3 : -1;
}

/* -- a worker: the scratch memory of one thread. */
typedef struct delaunay_worker delaunay_worker;
/* NULL: out of memory. */
DELAUNAY_API delaunay_worker *delaunay_worker_new(delaunay_memory *memory);
DELAUNAY_API void delaunay_worker_free(delaunay_worker *worker);

/* A list of tetrahedra that grows as needed; a worker or a caller owns it. Initialise it to zero,
 * except for the memory. */
typedef struct delaunay_list {
    delaunay_handle *items;
    size_t           count, cap;
    delaunay_memory *memory;
} delaunay_list;
DELAUNAY_API delaunay_result delaunay_list_push(delaunay_list *list, delaunay_handle item);
DELAUNAY_API void delaunay_list_free(delaunay_list *list);

/* -- stars and searches; they need vertex_tet (_INVALID_ARGUMENT without it). out is emptied first.
 * They find those tetrahedra that are connected through facets that contain the vertex or edge: the
 * whole star, in a valid mesh, unless facets without neighbours (DELAUNAY_NONE) divide it. */
DELAUNAY_API delaunay_result delaunay_vertex_star(const delaunay_mesh *mesh,
                                                  delaunay_worker *worker, uint32_t v,
                                                  delaunay_list *out);
/* The tetrahedra around edge ab, which t must contain. If they surround it, they are listed in the
 * order of rotation around it, from t on. */
DELAUNAY_API delaunay_result delaunay_edge_star(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                delaunay_handle t, uint32_t a, uint32_t b,
                                                delaunay_list *out);
/* A tetrahedron that contains the edge, or 0; of an edge to the ghost: a ghost. */
DELAUNAY_API delaunay_handle delaunay_find_edge(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                uint32_t a, uint32_t b);
/* The facet handle 4*t+i with these vertices, one of its two sides, or 0. One of the three may be
 * the ghost: a facet between two ghosts. */
DELAUNAY_API delaunay_handle delaunay_find_facet(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                 uint32_t a, uint32_t b, uint32_t c);
/* A tetrahedron that contains the point, in its interior or on its boundary; else a ghost whose
 * hull facet the point is beyond; else 0: the point is outside of a mesh without ghosts there, or a
 * coordinate is NaN or infinite.
 * Exact: a visibility walk with a bound on its steps, then a scan. hint may be 0. */
DELAUNAY_API delaunay_handle delaunay_locate(const delaunay_mesh *mesh, const double *xyz,
                                             delaunay_handle hint);

/* -- editing: the primitive on which recovery, refinement and improvement are built. */

/* Replaces connected tetrahedra by others that fill the same polyhedron.
 *
 *   old_tets num_old distinct tetrahedra, none deleted
 *   vertices 4 for each new tetrahedron, which is positive (the ghost, if any, is last); nothing is
 *            checked but that the new tetrahedra close the polyhedron
 *   slots    out, num_new entries, may be NULL: slots of the new ones (old slots first, in order)
 *
 * Links the new tetrahedra to each other and to those around the polyhedron. Constrained facets and
 * edges of the old tetrahedra stay marked on the new ones wherever the same triple or pair of
 * vertices still exists. All new tetrahedra get the colour of old_tets[0]. Sets vertex_tet of every
 * vertex of a new tetrahedron.
 * Returns DELAUNAY_OK; DELAUNAY_ERROR_INTERNAL: the new facets do not close the polyhedron;
 * _INVALID_ARGUMENT: one of old_tets is deleted, out of range, or there twice; _OUT_OF_MEMORY. On
 * failure the mesh is untouched.
 */
DELAUNAY_API delaunay_result delaunay_replace(delaunay_mesh *mesh, delaunay_worker *worker,
                                              const delaunay_handle *old_tets, size_t num_old,
                                              const uint32_t *vertices, size_t num_new,
                                              delaunay_handle *slots);
/* The neighbours and marks of new tetrahedra, from a caller that knows them. link[4*i+k] is the
 * facet on the other side of facet k of new tetrahedron i: if inside[4*i+k] is nonzero, it is
 * 4*j+l, facet l of new tetrahedron j; else it is the handle of a facet of the mesh that stays, or
 * DELAUNAY_NONE. flags[i] are the marks of tetrahedron i, if the mesh has marks. */
typedef struct delaunay_links {
    const delaunay_handle *link;   /* 4*num_new */
    const uint8_t         *inside; /* 4*num_new */
    const uint16_t        *flags;  /* num_new */
} delaunay_links;
/* The same as delaunay_replace, without its search for neighbours and marks: takes a third of its
 * time. Nothing is checked (delaunay_validate would find errors). Returns DELAUNAY_OK, or
 * _OUT_OF_MEMORY with the mesh untouched. */
DELAUNAY_API delaunay_result delaunay_replace_linked(delaunay_mesh *mesh, delaunay_worker *worker,
                                                     const delaunay_handle *old_tets,
                                                     size_t num_old, const uint32_t *vertices,
                                                     const delaunay_links *links, size_t num_new,
                                                     delaunay_handle *slots);
/* Marks (or unmarks) facet f on both sides. */
DELAUNAY_API void delaunay_mark_facet(delaunay_mesh *mesh, delaunay_handle f, int constrained);
/* Marks (or unmarks) edge ab in t, which contains it, and in all tetrahedra around it that are
 * connected with t as delaunay_edge_star finds them. Where facets without neighbours divide the
 * star, each part needs a call. */
DELAUNAY_API delaunay_result delaunay_mark_edge(delaunay_mesh *mesh, delaunay_worker *worker,
                                                delaunay_handle t, uint32_t a, uint32_t b,
                                                int constrained);

/* -- plain cavities: a quick search for the cavity of a point, which succeeds in simple ("plain")
 * cases only. A caller that inserts many points into a mesh with constraints, where not every
 * tetrahedron is Delaunay, tries it before its own search: it takes a fraction of the time. */
enum { DELAUNAY_PLAIN_MOST = 60, DELAUNAY_PLAIN_FACETS = 256 };
typedef struct delaunay_plain {
    delaunay_handle tets[DELAUNAY_PLAIN_MOST + 4]; /* the cavity, breadth first: 4*t+i, where t was
                                                    * reached through its facet i; i of the first
                                                    * one is 0, without a meaning */
    delaunay_handle border[DELAUNAY_PLAIN_FACETS]; /* facets of the boundary, as handles of the
                                                    * tetrahedra inside, in the order of tets */
    uint32_t num_tets, num_border;
    unsigned flags; /* those of all its tetrahedra, combined by OR: tells whether anything in it or
                     * on its boundary is constrained */
} delaunay_plain;
typedef enum delaunay_plainness {
    DELAUNAY_PLAIN,          /* the cavity was found */
    DELAUNAY_NOT_PLAIN,      /* a condition below does not hold, or a sign is in doubt */
    DELAUNAY_PLAIN_ELSEWHERE /* plain so far, but the cavity reaches beyond the section */
} delaunay_plainness;
/* Finds the cavity of point x: all tetrahedra whose spheres contain x and that are connected with
 * t, which is one of them, through facets that are not constrained. It is plain if it has at most
 * DELAUNAY_PLAIN_MOST tetrahedra, x sees its whole boundary, which includes the constrained facets
 * reached, and no other facet of its tetrahedra has a ghost behind it. Constrained edges may lie
 * inside it. If section is not NULL, all vertices of the cavity must have the key *section; those
 * of t must have it. The mesh must have marks, and all tetrahedra that are reached positive volume.
 * Exact. The cavity found is the same on every processor, but which cavities are found is not:
 * without AVX2, or with 64-bit handles, the result is always DELAUNAY_NOT_PLAIN.
 * Threads  several may call this on one mesh at the same time, each with its own section */
DELAUNAY_API delaunay_plainness delaunay_plain_cavity(delaunay_plain *plain, delaunay_mesh *mesh,
                                                      const double *x, delaunay_handle t,
                                                      const uint32_t *section);

/* -- an editor inserts and removes single points of a Delaunay triangulation. After each call the
 * mesh is the triangulation of its vertices that delaunay_tetrahedralize would make, ties included;
 * only the order of the slots differs (see delaunay_canonicalize). A mesh has one editor at a time.
 * The editor keeps vertex_tet up to date, but not vertex_of and num_points: delaunay_insert and,
 * for vertices without an id, delaunay_export_tets number on from num_points, whatever ids the
 * editor was given. Between its calls the mesh may be edited in other ways, and
 * delaunay_canonicalize may be called. Constraint marks do not survive an insertion, whose new
 * tetrahedra are DELAUNAY_OUTSIDE. Those of a removal have the colour of a real tetrahedron that
 * they replace; ghosts, that of a ghost. */
typedef struct delaunay_editor delaunay_editor;
/* The mesh must have its hull (ghosts) and no weights. NULL: it is not so, or out of memory. */
DELAUNAY_API delaunay_editor *delaunay_editor_new(delaunay_mesh *mesh);
DELAUNAY_API void delaunay_editor_free(delaunay_editor *editor);
/* Inserts a new vertex with the caller's id; *vertex (may be NULL) is its number, or that of the
 * vertex that is at xyz already. hint: a tetrahedron nearby, 0: where the editor was last.
 * Returns DELAUNAY_OK; _ERROR_NOT_FINITE, _OUT_OF_MEMORY, _TOO_LARGE: nothing has changed.
 * Cost     the walk from the hint, then about a microsecond */
DELAUNAY_API delaunay_result delaunay_editor_insert(delaunay_editor *editor, const double *xyz,
                                                    uint32_t id, delaunay_handle hint,
                                                    uint32_t *vertex);
/* The same for a vertex of the mesh that is in no tetrahedron: one that delaunay_add_vertex added
 * or delaunay_editor_remove removed. _ERROR_INVALID_ARGUMENT: it is in a tetrahedron, or another
 * vertex is at its place. */
DELAUNAY_API delaunay_result delaunay_editor_insert_vertex(delaunay_editor *editor, uint32_t vertex,
                                                           delaunay_handle hint);
/* Takes a vertex out of the triangulation; it stays in the arrays, in no tetrahedron.
 * Returns DELAUNAY_OK; _ERROR_DIMENSION: the other vertices lie in one plane;
 * _ERROR_INVALID_ARGUMENT: it is in no tetrahedron; _OUT_OF_MEMORY. On failure nothing has changed.
 * Cost     a small triangulation of its neighbours, about 30 microseconds
 * Source   the hole is filled from the Delaunay triangulation of its corners, with the tetrahedra
 *          that lie in the hole. The new tetrahedra of the whole mesh are among them: their spheres
 *          contain no point of the mesh, so no corner, and perturbed ties have one answer */
DELAUNAY_API delaunay_result delaunay_editor_remove(delaunay_editor *editor, uint32_t vertex);

/* -- queries: the hull, the Voronoi diagram and alpha values of a triangulation. Results refer to
 * vertices and slots of the mesh (mesh->vertex_id and mesh->vertex_of lead to the caller's points)
 * and are in arrays that the result owns. They depend on the mesh alone. The result must be zeroed
 * before its first use; each call replaces what it had before. On failure it is empty:
 * DELAUNAY_ERROR_INVALID_ARGUMENT (a null pointer, or a mesh without its hull), _OUT_OF_MEMORY.
 * Serial; several calls may run at the same time on one mesh. */

/* The exact convex hull, as triangles and as the flat polygons that they form. */
typedef struct delaunay_hull {
    size_t    num_facets, num_polygons;
    uint32_t *facets;           /* 3 vertices per facet, counterclockwise seen from outside */
    uint32_t *facet_polygon;    /* of each facet: its polygon; facets of one polygon are coplanar */
    size_t   *polygon_begin;    /* num_polygons + 1: polygon p has polygon_vertices[i] with
                                 * polygon_begin[p] <= i < polygon_begin[p+1] */
    uint32_t *polygon_vertices; /* counterclockwise, including vertices within a straight side */
    delaunay_memory memory;
} delaunay_hull;
DELAUNAY_API delaunay_result delaunay_hull_of(delaunay_hull *hull, const delaunay_mesh *mesh,
                                              const delaunay_host *host);
DELAUNAY_API void delaunay_hull_free(delaunay_hull *hull);

/* The Voronoi diagram, or with weights the power diagram: a cell for each vertex and a face for
 * each edge of the triangulation. The corners of a face are the centres of the tetrahedra around
 * its edge. The face of a hull edge is unbounded: its list of corners begins and ends with a ghost,
 * whose "centre" is the direction of the unbounded side. Centres are in doubles, at any scale: with
 * q the volume of a tetrahedron relative to the product of its three edges at the corner nearest to
 * the others, the error is some 1e-15 / q of the radius. So nothing is known where rounding has
 * made q as small as 1e-14: then, or with weights 1e150 times the squares of edges, a centre may be
 * anything, even not a number. A coordinate beyond the largest double becomes infinite. */
typedef struct delaunay_voronoi {
    size_t   num_cells; /* mesh->num_vertices; the ghost and vertices in no tetrahedron have empty
                         * cells */
    size_t   num_faces;
    double  *centers; /* 3 per slot of the mesh, rounded; ghost: outward unit normal; deleted: 0 */
    uint32_t *face_cells; /* 2 per face: the vertices a < b on either side */
    size_t  *face_begin; /* num_faces + 1: where the corners of each face begin in face_tets */
    delaunay_handle *face_tets; /* the corners as slots, counterclockwise seen from b */
    size_t  *cell_begin; /* num_cells + 1: where the faces of each cell begin in cell_faces */
    size_t  *cell_faces;
    delaunay_memory memory;
} delaunay_voronoi;
DELAUNAY_API delaunay_result delaunay_voronoi_of(delaunay_voronoi *voronoi,
                                                 const delaunay_mesh *mesh,
                                                 const delaunay_host *host);
DELAUNAY_API void delaunay_voronoi_free(delaunay_voronoi *voronoi);

/* Alpha values, which are squared radii: a simplex is in the alpha complex of every alpha that is
 * at least its own value. This is the squared radius of its smallest circumscribed sphere if that
 * sphere is empty, else the least value of the simplices of which it is a face; so no simplex
 * appears before its faces. Vertices have value 0. Values are rounded, as Voronoi centres are; they
 * are DBL_MAX or 0 where the square is beyond the range of doubles. With weights the spheres are
 * orthogonal to those of the vertices, and the value of a vertex is the negative of its weight, or
 * more. */
typedef struct delaunay_alpha {
    double *tets;   /* one per slot; DBL_MAX for ghosts and deleted ones */
    double *facets; /* 4 per slot, equal on both sides; of a ghost only that of facet 3 */
    double *edges;  /* one per face of the Voronoi diagram */
    delaunay_memory memory;
} delaunay_alpha;
DELAUNAY_API delaunay_result delaunay_alpha_of(delaunay_alpha *alpha, const delaunay_mesh *mesh,
                                               const delaunay_voronoi *voronoi,
                                               const delaunay_host *host);
DELAUNAY_API void delaunay_alpha_free(delaunay_alpha *alpha);

/* The vertex nearest to a point, exactly (one of them, if there are several), in a Delaunay mesh of
 * all its vertices; in another one, an imported mesh say, a vertex that is nearer than those beside
 * it. 0: out of memory, an empty mesh, one with weights or without vertex_tet, a point outside a
 * mesh without its hull, or a coordinate that is NaN or infinite.
 * hint: a tetrahedron nearby, or 0.
 * Source: a vertex that is not the nearest has a Delaunay neighbour that is nearer. */
DELAUNAY_API uint32_t delaunay_nearest(const delaunay_mesh *mesh, delaunay_worker *worker,
                                       const double *xyz, delaunay_handle hint);
/* -1: a is nearer to q than b, 0: neither, 1: b. Exact. */
DELAUNAY_API int delaunay_compare_distance(const double *q, const double *a, const double *b);

/* -- closure search: the best triangulation of one small polyhedron [Marot 2020, 6.2].
 * Boundary recovery looks for fewer crossings of a missing edge or facet, mesh improvement for a
 * better worst quality. */
enum {
    DELAUNAY_WINDOW_VERTICES = 32,
    DELAUNAY_WINDOW_TETS     = 400, /* at most so many old, and so many new tetrahedra */
    DELAUNAY_WINDOW_FACETS   = 512,
    DELAUNAY_WINDOW_KEPT     = 64
};

/* A window: a connected set of tetrahedra, none of them a ghost, and the polyhedron that is their
 * union. */
typedef struct delaunay_window {
    uint32_t        num_tets, num_vertices, num_facets, num_kept_edges, num_kept_facets;
    delaunay_handle tets[DELAUNAY_WINDOW_TETS];
    uint32_t        vertices[DELAUNAY_WINDOW_VERTICES]; /* of the mesh; an index into this array is
                                                         * a local vertex, as in what follows */
    uint8_t         facets[DELAUNAY_WINDOW_FACETS][3];    /* boundary, outward order */
    uint8_t         kept_edges[DELAUNAY_WINDOW_KEPT][2];  /* constrained, interior: must stay */
    uint8_t         kept_facets[DELAUNAY_WINDOW_KEPT][3]; /* constrained, interior: must stay */
    uint32_t        interior; /* bit mask of the vertices that are not on the boundary */
    uint32_t        dropped;  /* bit mask of interior vertices to be left out; set by the caller */
} delaunay_window;

/* Fills a window from a set of tetrahedra. keep_edges, keep_facets: nonzero to list the constrained
 * edges and facets in its interior; those that are not listed may vanish.
 * Returns 1, or 0 if there is a ghost among the tetrahedra, there are more than max_vertices (at
 * most 32) vertices, or the window has too many tetrahedra, facets or kept edges or facets. */
DELAUNAY_API int delaunay_window_set(delaunay_window *window, const delaunay_mesh *mesh,
                                     const delaunay_handle *tets, size_t num_tets,
                                     uint32_t max_vertices, int keep_edges, int keep_facets);

/* What is wanted of the triangulation of a window. */
typedef enum delaunay_objective {
    DELAUNAY_ANY,             /* nothing: any triangulation */
    DELAUNAY_BEST_QUALITY,    /* the greatest possible worst quality, greater than bound */
    DELAUNAY_FEWER_FACES,     /* fewer interior faces that cross segment target[0..1] than bound */
    DELAUNAY_FEWER_EDGES,     /* fewer interior edges that cross triangle target[0..2] than bound */
    DELAUNAY_FEWER_BAD        /* fewer than num_bad qualities below good, all above bound */
} delaunay_objective;

/* Flags that turn heuristics off, to measure what each is worth; the result is as good. */
enum {
    DELAUNAY_SEARCH_ANY_FACET = 1, /* take the newest triangle, not that with fewest candidates */
    DELAUNAY_SEARCH_ANY_ORDER = 2, /* take candidates in order of number, not of score */
    DELAUNAY_SEARCH_NO_MEMORY = 4, /* compute a quality whenever it is needed, remember none */
    DELAUNAY_SEARCH_FORGET    = 8  /* reuse nothing from the last search: quality() has changed */
};

/* Zero the members that are not set. */
typedef struct delaunay_search {
    delaunay_objective objective;
    uint32_t flags;       /* DELAUNAY_SEARCH_*; 0: the fast way */
    /* BEST_QUALITY, FEWER_BAD: larger is better; 0 or less: unacceptable. Called with positive
     * tetrahedra, once for each, and must depend on nothing but the points (any order of them must
     * give the same bits). */
    double (*quality)(void *user, const double *a, const double *b, const double *c,
                      const double *d);
    /* NULL, or the same, except for rounding, for the n tetrahedra of facet abc and n apices, n at
     * most DELAUNAY_WINDOW_VERTICES; faster where several can be computed at once. The coordinates
     * of apex i are apices[i], apices[i + DELAUNAY_WINDOW_VERTICES] and
     * apices[i + 2 * DELAUNAY_WINDOW_VERTICES]; the entries of apices and out beyond n may be read
     * and written, too. */
    void   (*qualities)(void *user, const double *a, const double *b, const double *c, size_t n,
                        const double *apices, double *out);
    void    *user;
    double   bound;       /* a result must be strictly better: above (quality), below (crossings) */
    double   good;        /* FEWER_BAD: a quality below this is bad */
    uint32_t num_bad;     /* FEWER_BAD: a result has fewer bad ones; out: how many it has */
    /* BEST_QUALITY, if not NULL: the weight, 1 or more, of a tetrahedron with a quality below good.
     * A result has at most num_bad such tetrahedra, of a total weight of at most max_weight. */
    double (*weigh)(void *user, double quality);
    double   max_weight;
    uint32_t target[3];   /* mesh vertices */
    uint32_t max_nodes;   /* of the search tree; 0: 100000 */
    /* out */
    int      proven;      /* 1: the search was exhaustive: the result is the best, or none exists */
    uint32_t nodes;       /* of the search tree, visited */
    double   value;       /* worst quality, or number of crossings, of the result */
    uint32_t num_tets;
    uint8_t  tets[DELAUNAY_WINDOW_TETS][4]; /* of the result: local vertices, positive */
} delaunay_search;

/* Searches for a triangulation of the window that meets the objective. Returns 1 if it found one,
 * else 0 (proven tells whether there is none, or max_nodes was reached). Searches for fewer
 * crossings stop at the first strict decrease. Exact orientation tests only; no intersection tests
 * are needed (proof in >>reconnect). Thread-safe. */
DELAUNAY_API int delaunay_reconnect(const delaunay_mesh *mesh, delaunay_worker *worker,
                                    const delaunay_window *window, delaunay_search *search);
/* Replaces the window's tetrahedra by the result of a search (see delaunay_replace). slots may be
 * NULL. */
DELAUNAY_API delaunay_result delaunay_window_apply(delaunay_mesh *mesh, delaunay_worker *worker,
                                                   const delaunay_window *window,
                                                   const delaunay_search *search,
                                                   delaunay_handle *slots);
/* The number of crossings in the window's present triangulation: the initial bound for the
 * objectives FEWER_FACES and FEWER_EDGES. */
DELAUNAY_API uint32_t delaunay_window_crossings(const delaunay_mesh *mesh,
                                                const delaunay_window *window,
                                                delaunay_objective objective,
                                                const uint32_t *target);
/* The crossing test itself, exact, for vertices of the mesh: whether the open segment ab crosses
 * the closed triangle pqr, with no vertex shared and a and b strictly on opposite sides of its
 * plane. *zeros (may be NULL) gets bits 0, 1, 2 for the edges pq, qr, rp that it meets exactly. */
DELAUNAY_API int delaunay_segment_crosses(const delaunay_mesh *mesh, uint32_t a, uint32_t b,
                                          uint32_t p, uint32_t q, uint32_t r, int *zeros);

/* -- engine (a): many insertions at once, in sections of a closed curve [Marot 2020, chapter 4].
 * Every vertex of the mesh gets a key, its position on a Moore curve. The curve is cut into
 * sections, each with its share of the items (vertices to be inserted), and each section is edited
 * by one thread. An edit reads tetrahedra of its section (all their vertices have keys in it) and
 * their neighbours, and writes tetrahedra of its section. Where that is not enough, it returns
 * DELAUNAY_ITEM_CONFLICT, and must have written nothing. Items left over are tried again on another
 * curve, in fewer sections as fewer succeed, and finally one by one. Slots come from the section:
 * nothing is allocated, and no thread waits for another.
 *
 *     static int edit(void *user, delaunay_section *section, uint32_t vertex)
 *     {
 *         if (too_close(user, vertex)) return DELAUNAY_ITEM_NOTHING;
 *         return delaunay_section_insert(section, vertex);
 *     }
 *     ...
 *     delaunay_partition job = {0};
 *     job.vertices = those;          // of the mesh, in no tetrahedron yet (delaunay_add_vertex)
 *     job.num_vertices = how_many;
 *     job.edit = edit;
 *     delaunay_result result = delaunay_partition_run(&mesh, &job, NULL);
 *
 * The mesh must be closed (it has ghosts, or a boundary that no edit touches), and without marks
 * (delaunay_enable_marks): an insertion leaves those of the slots that it reuses. vertex_tet is not
 * kept up to date: call delaunay_link_vertices afterwards. */

/* What one thread may touch in one attempt, and its scratch memory. */
typedef struct delaunay_section delaunay_section;

/* Return values of an edit; a negative delaunay_result ends the run, with the mesh valid. */
enum { DELAUNAY_ITEM_DONE = 0, DELAUNAY_ITEM_NOTHING = 1, DELAUNAY_ITEM_CONFLICT = 2 };

typedef struct delaunay_partition {
    const uint32_t *vertices; /* the items */
    size_t num_vertices;
    /* Inserts a vertex. Several threads call it at the same time, each for one section at a time.
     * NULL: plain Delaunay insertion. */
    int (*edit)(void *user, delaunay_section *section, uint32_t vertex);
    void *user;
    int num_sections;  /* in the first attempt; 0: one for each thread. The sections depend on this
                        * number alone. The order of edits does not quite: an item for which a
                        * thread's buffers are too small waits as after a conflict. So only edits
                        * whose result does not depend on their order, as Delaunay insertion, give
                        * the same mesh for any number of threads */
    const char *phase; /* for the host's progress callback */
    uint64_t attempts, conflicts; /* out */
} delaunay_partition;

/* Returns DELAUNAY_OK; _INVALID_ARGUMENT: num_sections below 0, nothing done; on _CANCELLED,
 * _OUT_OF_MEMORY or an edit's error the mesh is valid, with some of the items done. */
DELAUNAY_API delaunay_result delaunay_partition_run(delaunay_mesh *mesh, delaunay_partition *job,
                                                    const delaunay_host *host);
/* Delaunay insertion; returns what an edit returns. _NOTHING: a vertex is at that place already. */
DELAUNAY_API int delaunay_section_insert(delaunay_section *section, uint32_t vertex);
/* Whether the section's thread may write this tetrahedron: all its vertices, except for the ghost,
 * must be the section's. Call it only for tetrahedra of the section and their neighbours: other
 * threads may be changing any other one at this moment. */
DELAUNAY_API int delaunay_section_owns_tet(const delaunay_section *section, delaunay_handle t);
DELAUNAY_API int delaunay_section_owns(const delaunay_section *section, uint32_t vertex);
/* The hint is a tetrahedron of the section near the last insertion, where the next walk begins.
 * delaunay_section_insert sets it; an edit that writes tetrahedra itself must set it, too. */
DELAUNAY_API delaunay_handle delaunay_section_hint(const delaunay_section *section);
DELAUNAY_API void delaunay_section_set_hint(delaunay_section *section, delaunay_handle t);
/* The number of the worker, 0 .. threads-1: for a caller's own scratch memory. */
DELAUNAY_API int delaunay_section_worker(const delaunay_section *section);
/* Take slots for new tetrahedra; give slots back (they become deleted ones). They return what an
 * edit returns; nothing has changed unless it is DELAUNAY_ITEM_DONE. */
DELAUNAY_API int delaunay_section_take(delaunay_section *section, size_t count,
                                       delaunay_handle *slots);
DELAUNAY_API int delaunay_section_give(delaunay_section *section, const delaunay_handle *slots,
                                       size_t count);

/* -- engine (b): many small edits, with the same bytes for any number of threads. Each round plans
 * edits for the next items of a list, in parallel, on the mesh as it is. Where plans conflict, the
 * one that comes first in the list wins. The winners are written to the mesh in parallel; the other
 * plans wait for the next round, and are made again only if something that they read has changed.
 * The first plan always wins. There are no locks, and nothing is ever undone.
 *
 *     // moves each vertex to the mean of its neighbours, if all tetrahedra stay positive
 *     static int plan(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
 *                     delaunay_plan *p)
 *     {
 *         uint32_t v = 1 + (uint32_t)item;
 *         double x[3] = {0, 0, 0};
 *         delaunay_result result = delaunay_vertex_star(m, worker, v, &p->star);
 *         if (result != DELAUNAY_OK) return result;
 *         for (size_t i = 0; i < p->star.count; i++) {
 *             const delaunay_tet *t = &m->tets[p->star.items[i]];
 *             if (t->v[3] == DELAUNAY_GHOST) return DELAUNAY_PLAN_NOTHING;
 *             for (int k = 0; k < 3; k++)
 *                 for (int j = 0; j < 4; j++)
 *                     if (t->v[j] != v)
 *                         x[k] += m->vertices[t->v[j]].x[k] / (3.0 * (double)p->star.count);
 *         }
 *         for (size_t i = 0; i < p->star.count; i++) {
 *             const uint32_t *q = m->tets[p->star.items[i]].v;
 *             const double *c[4];
 *             for (int k = 0; k < 4; k++) c[k] = q[k] == v ? x : m->vertices[q[k]].x;
 *             if (delaunay_orient3d(c[0], c[1], c[2], c[3]) <= 0) return DELAUNAY_PLAN_NOTHING;
 *         }
 *         return delaunay_plan_move(p, v, x, p->star.items, p->star.count);
 *     }
 *     ...
 *     if (delaunay_link_vertices(&mesh) != DELAUNAY_OK) return 1;   // for delaunay_vertex_star
 *     delaunay_engine *engine = delaunay_engine_new(&mesh, NULL);   // NULL: out of memory
 *     delaunay_speculation job = {0};
 *     job.num_items = mesh.num_vertices - 1;
 *     job.plan = plan;
 *     job.scatter = 1;
 *     delaunay_result result = delaunay_speculate(engine, &job);
 *     delaunay_engine_free(engine);
 */

/* The edit planned for an item. A plan function fills it with the functions below; done() reads
 * it. */
typedef struct delaunay_plan {
    delaunay_list star, scratch;    /* for the plan function, to use as it likes */
    uint64_t      data[8];          /* from plan() to done(), for the caller; 0 before plan() */
    /* filled by the functions delaunay_plan_*: */
    delaunay_list read, written, old_tets;
    uint32_t     *tets;             /* 4 vertices per new tetrahedron */
    size_t        num_tets, cap_tets;
    uint32_t      num_new, num_moved;
    double        new_xyz[8][3], moved_xyz[8][3];
    uint32_t      moved[8];
    /* for done(): */
    int           committed;        /* 0: nothing was done */
    uint32_t      first_vertex;     /* the first of the new vertices, which follow each other */
    delaunay_list slots;            /* of the new tetrahedra */
    /* private to the engine: */
    size_t           item, surplus, freed;
    delaunay_handle *link;
    uint8_t         *link_inside;
    uint16_t        *link_flags;
    size_t           cap_link;
    uint32_t         round, color;
    int              state;
    delaunay_memory *memory;
} delaunay_plan;

/* Return values of a plan function; a negative delaunay_result ends the call, the mesh valid. */
#define DELAUNAY_PLAN_NOTHING 0
#define DELAUNAY_PLAN_COMMIT  1

enum { DELAUNAY_PLAN_VERTICES = 8 }; /* a plan has at most 8 new and 8 moved vertices */
/* In the new tetrahedra of a plan: its k-th new vertex. */
#define DELAUNAY_PLAN_VERTEX(k) (UINT32_MAX - 1u - (uint32_t)(k))

/* These functions return DELAUNAY_PLAN_COMMIT or a negative delaunay_result, which the plan
 * function is to return. */

/* The plan depends on this tetrahedron (the positions of its vertices, its neighbours, its marks).
 * Tetrahedra that are removed, or in the star of a vertex that moves, need not be listed again. */
DELAUNAY_API int delaunay_plan_read(delaunay_plan *plan, delaunay_handle t);
/* A tetrahedron to be replaced, and one that takes part in replacing them; the rules are those of
 * delaunay_replace. */
DELAUNAY_API int delaunay_plan_remove(delaunay_plan *plan, delaunay_handle t);
DELAUNAY_API int delaunay_plan_add(delaunay_plan *plan, uint32_t a, uint32_t b, uint32_t c,
                                   uint32_t d);
/* A new vertex, with id DELAUNAY_NO_ID; at most 8. In delaunay_plan_add the first one is called
 * DELAUNAY_PLAN_VERTEX(0), the next one DELAUNAY_PLAN_VERTEX(1), and so on. */
DELAUNAY_API int delaunay_plan_vertex(delaunay_plan *plan, const double *xyz);
/* A vertex that moves; star: all tetrahedra that contain it. At most 8. */
DELAUNAY_API int delaunay_plan_move(delaunay_plan *plan, uint32_t v, const double *xyz,
                                    const delaunay_handle *star, size_t num_star);
/* Replaces the tetrahedra of a window by the result of a search. */
DELAUNAY_API int delaunay_plan_window(delaunay_plan *plan, const delaunay_window *window,
                                      const delaunay_search *search);

typedef struct delaunay_speculation {
    /* The items are 0 .. num_items-1, in this order; done() may raise num_items, but not with
     * scatter. */
    size_t num_items;
    /* Decides what to do about an item: reads the mesh, fills the plan. Several threads call it at
     * the same time. What it decides may depend only on the item and on the tetrahedra that the
     * plan lists. */
    int (*plan)(void *user, const delaunay_mesh *mesh, delaunay_worker *worker, size_t item,
                delaunay_plan *plan);
    /* May be NULL. Called after each round by the calling thread, for each item that is finished,
     * in order. It may write marks and colours of tetrahedra if it then calls delaunay_engine_touch
     * for them. A nonzero result stops after this round (DELAUNAY_STOPPED_BY_BUDGET). */
    int (*done)(void *user, delaunay_mesh *mesh, delaunay_worker *worker, size_t item,
                const delaunay_plan *plan);
    void  *user;
    uint32_t    batch;   /* at most so many items in a round; 0: 1024. The result depends on it */
    int scatter; /* nonzero: take the items in a scattered order, so that few plans conflict where
                  * neighbours in the list are neighbours in space */
    const char *phase;   /* for the host's progress callback */
    double from, to;     /* the first and the last fraction that it reports; both 0: 0 and 1 */
    size_t max_vertices; /* of the mesh, including the ghost: a plan that would exceed it counts as
                          * DELAUNAY_PLAN_NOTHING; 0: no limit but that of 32-bit numbers */
    uint64_t rounds, plans, commits, conflicts; /* out; a conflict: an item waits for another one */
} delaunay_speculation;

/* An engine has workers, plans, and a version of each tetrahedron, for all calls of a stage. The
 * mesh must outlive it. */
typedef struct delaunay_engine delaunay_engine;
DELAUNAY_API delaunay_engine *delaunay_engine_new(delaunay_mesh *mesh, const delaunay_host *host);
DELAUNAY_API void delaunay_engine_free(delaunay_engine *engine);
/* Returns DELAUNAY_OK; _STOPPED_BY_BUDGET: done() stopped it; _CANCELLED: the host stopped it;
 * _OUT_OF_MEMORY; an error of a plan function; _ERROR_INTERNAL: the new tetrahedra of a plan do not
 * close its polyhedron. The mesh is valid in every case.
 * Repeats  same bytes for any number of threads */
DELAUNAY_API delaunay_result delaunay_speculate(delaunay_engine *engine, delaunay_speculation *job);
/* The version of a tetrahedron: the round in which it was last written; 0: never by this engine.
 * Rounds are counted on from call to call. So an item need not be tried again if all its tetrahedra
 * are older than its last failure. */
DELAUNAY_API uint32_t delaunay_engine_version(const delaunay_engine *engine, delaunay_handle t);
DELAUNAY_API uint32_t delaunay_engine_round(const delaunay_engine *engine);
/* Tells the engine that the caller has changed tetrahedron t: plans that read it are made again.
 * Call it between calls of delaunay_speculate, or in done(). */
DELAUNAY_API delaunay_result delaunay_engine_touch(delaunay_engine *engine, delaunay_handle t);
/* One of the engine's workers, to be used between calls of delaunay_speculate. thread: 0, or a
 * different number for each of the threads that work at the same time. NULL: the engine has not so
 * many workers. */
DELAUNAY_API delaunay_worker *delaunay_engine_worker(delaunay_engine *engine, int thread);
/* An engine for one thread that uses the caller's worker: for many small meshes one after the
 * other, where it would take too long to zero the tables of a new worker for each. */
DELAUNAY_API delaunay_engine *delaunay_engine_new_lent(delaunay_mesh *mesh,
                                                       const delaunay_host *host,
                                                       delaunay_worker *worker);

#ifdef __cplusplus
}
#endif
#endif /* DELAUNAY_H */

/* ============================================================================================
 * Readers of the interface can stop here.
 * ============================================================================================ */
#if defined(DELAUNAY_IMPLEMENTATION) && !defined(DELAUNAY_IMPLEMENTATION_DONE)
#define DELAUNAY_IMPLEMENTATION_DONE
#include <limits.h>
#include <math.h>
#include <stdio.h> /* snprintf only */
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifdef _OPENMP
#  include <omp.h>
#endif
/* Using several threads takes OpenMP, and atomic operations, which C99 does not have. */
#if defined(_OPENMP) && defined(__GNUC__)
#  define DELAUNAY__PARALLEL       1
#  define DELAUNAY__OMP(directive) _Pragma(#directive)
#else
#  define DELAUNAY__PARALLEL 0
#  define DELAUNAY__OMP(directive)
#endif
#if defined(__linux__) && !defined(__STRICT_ANSI__)
#  include <sys/mman.h> /* madvise */
#endif
#if DELAUNAY__PARALLEL && (defined(__linux__) || defined(__APPLE__))
#  include <sched.h>
#  define DELAUNAY__YIELD() ((void)sched_yield())
#else
#  define DELAUNAY__YIELD() ((void)0)
#endif
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__i386__))
#  define DELAUNAY__PAUSE() __builtin_ia32_pause()
#elif defined(__GNUC__) && defined(__aarch64__)
#  define DELAUNAY__PAUSE() __asm__ __volatile__("yield")
#else
#  define DELAUNAY__PAUSE() ((void)0)
#endif

#if defined(__GNUC__)
#  define DELAUNAY__UNLIKELY(x) __builtin_expect(!!(x), 0)
#  define DELAUNAY__NOINLINE __attribute__((noinline))
#  define DELAUNAY__ALWAYS_INLINE __attribute__((always_inline)) DELAUNAY_INLINE
#  define DELAUNAY__PREFETCH(p) __builtin_prefetch(p)
#  define DELAUNAY__PREFETCH_WRITE(p) __builtin_prefetch((p), 1)
#else
#  define DELAUNAY__UNLIKELY(x) (x)
#  define DELAUNAY__NOINLINE
#  define DELAUNAY__ALWAYS_INLINE DELAUNAY_INLINE
#  define DELAUNAY__PREFETCH(p) ((void)(p))
#  define DELAUNAY__PREFETCH_WRITE(p) ((void)(p))
#endif
#if defined(__GNUC__) && defined(__x86_64__) && !defined(DELAUNAY_NO_SIMD)
#  include <immintrin.h>
#  define DELAUNAY__AVX2                                                                           \
    (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&                            \
     __builtin_cpu_supports("popcnt"))
#  define DELAUNAY__TARGET __attribute__((target("avx2,fma,popcnt")))
#endif

/* ---- >>memory ----------------------------------------------------------------------------- */

/* Large blocks get huge pages where the system has them, from their beginning to their end, as the
 * first access to a page of 4 KB costs more than all work on its contents: they begin at one, and
 * the last of which they use at least half is theirs. Large is two huge pages, or half a one for an
 * account that holds several: blocks of small meshes come again and again, often used in part. */
enum { DELAUNAY__HUGE_PAGE = 2 << 20 };

/* Returns where a block of size bytes begins; *base is what to free. (glibc's heap would grow with
 * each block if malloc were asked for aligned ones: it does not look for them among freed ones.) */
static void *delaunay__malloc_beside(size_t held, size_t size, void **base)
{
#if defined(MADV_HUGEPAGE)
    const size_t page = DELAUNAY__HUGE_PAGE, large = held < 8 * page ? 2 * page : page / 2;
    if (size >= large && size <= SIZE_MAX - 2 * page) {
        size_t whole = (size + page / 2) / page * page;
        char *block = (char *)(*base = malloc((whole > size ? whole : size) + page));
        if (!block) return NULL;
        block += (page - (size_t)((uintptr_t)block % page)) % page;
        (void)madvise(block, whole, MADV_HUGEPAGE); /* a hint: may fail */
        return block;
    }
#endif
    (void)held;
    return *base = malloc(size);
}
static void *delaunay__malloc(void *user, size_t size)
{
    (void)user;
    return malloc(size);
}
/* Zeroed memory: what the system has just cleared is not cleared again. */
static void *delaunay__calloc(size_t size)
{
    void *block = calloc(1, size);
#if defined(MADV_HUGEPAGE)
    if (block && size >= 2 * DELAUNAY__HUGE_PAGE) {
        size_t skip = DELAUNAY__HUGE_PAGE - (size_t)((uintptr_t)block % DELAUNAY__HUGE_PAGE);
        (void)madvise((char *)block + skip,
                      (size - skip) / DELAUNAY__HUGE_PAGE * DELAUNAY__HUGE_PAGE, MADV_HUGEPAGE);
    }
#endif
    return block;
}
static void delaunay__free(void *user, void *block)
{
    (void)user;
    free(block);
}

/* The header in front of each block, with what release must know. Blocks begin at multiples of 64
 * bytes. */
typedef struct delaunay__block {
    void *base;
    size_t size; /* as requested from the allocator */
} delaunay__block;
enum { DELAUNAY__ALIGN = 64 };

DELAUNAY_API delaunay_result delaunay_memory_init(delaunay_memory *memory,
                                                  const delaunay_host *host)
{
    memset(memory, 0, sizeof *memory);
    if (host) {
        memory->allocator = host->allocator;
        memory->limit_bytes = host->memory_limit_bytes;
        if (!host->allocator.alloc != !host->allocator.release || host->num_threads < 0)
            return DELAUNAY_ERROR_INVALID_ARGUMENT;
    }
    if (!memory->allocator.alloc) {
        memory->allocator.alloc = delaunay__malloc;
        memory->allocator.release = delaunay__free;
    }
    return DELAUNAY_OK;
}

static void *delaunay__alloc(delaunay_memory *memory, size_t count, size_t size, int zeroed)
{
    size_t total;
    int own;
    void *base;
    char *from, *block;
    delaunay__block *head;
    if (size != 0 && count > (SIZE_MAX - 2 * DELAUNAY__ALIGN) / size) return NULL;
    if (!memory->allocator.alloc) { /* a zeroed account */
        memory->allocator.alloc = delaunay__malloc;
        memory->allocator.release = delaunay__free;
    }
    total = count * size + 2 * DELAUNAY__ALIGN;
    if (memory->limit_bytes &&
        (total > memory->limit_bytes || memory->bytes > memory->limit_bytes - total))
        return NULL;
    own = memory->allocator.alloc == delaunay__malloc;
    if (own && !zeroed) {
        from = (char *)delaunay__malloc_beside(memory->bytes, total, &base);
    } else {
        base = own ? delaunay__calloc(total)
                   : memory->allocator.alloc(memory->allocator.user, total);
        from = (char *)base;
    }
    if (!from) return NULL;
    block = from + (2 * DELAUNAY__ALIGN - (size_t)((uintptr_t)from % DELAUNAY__ALIGN));
    head = (delaunay__block *)(void *)(block - DELAUNAY__ALIGN);
    head->base = base;
    head->size = total;
    memory->bytes += total;
    if (memory->bytes > memory->peak_bytes) memory->peak_bytes = memory->bytes;
    if (zeroed && !own) memset(block, 0, count * size);
    return block;
}

DELAUNAY_API void *delaunay_alloc(delaunay_memory *memory, size_t count, size_t size)
{
    return delaunay__alloc(memory, count, size, 0);
}

DELAUNAY_API void *delaunay_alloc_zeroed(delaunay_memory *memory, size_t count, size_t size)
{
    return delaunay__alloc(memory, count, size, 1);
}

DELAUNAY_API void delaunay_release(delaunay_memory *memory, void *block)
{
    delaunay__block head;
    if (!block) return;
    head = *(delaunay__block *)(void *)((char *)block - DELAUNAY__ALIGN);
    memory->bytes -= head.size;
    memory->allocator.release(memory->allocator.user, head.base);
}

static void *delaunay__grow(delaunay_memory *memory, void *old, size_t keep, size_t count,
                            size_t size, int zeroed)
{
    void *block = delaunay__alloc(memory, count, size, zeroed);
    if (!block) return NULL;
    if (keep && old) memcpy(block, old, keep * size);
    delaunay_release(memory, old);
    return block;
}

DELAUNAY_API void *delaunay_grow(delaunay_memory *memory, void *old, size_t keep, size_t count,
                                 size_t size)
{
    return delaunay__grow(memory, old, keep, count, size, 0);
}

DELAUNAY_API void *delaunay_grow_zeroed(delaunay_memory *memory, void *old, size_t keep,
                                        size_t count, size_t size)
{
    return delaunay__grow(memory, old, keep, count, size, 1);
}

DELAUNAY_API double delaunay_seconds(const delaunay_host *host)
{
    if (host && host->clock) return host->clock(host->user);
#  ifdef _OPENMP
    return omp_get_wtime();
#  elif defined(__wasi__) /* has no clock() */
    struct timespec now;
    if (clock_gettime(CLOCK_MONOTONIC, &now) != 0) return 0;
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
#  else
    return (double)clock() / (double)CLOCKS_PER_SEC;
#  endif
}

enum { DELAUNAY__MOST_THREADS = 1024 };

DELAUNAY_API int delaunay_threads(const delaunay_host *host)
{
#  if DELAUNAY__PARALLEL
    int threads = host && host->num_threads > 0 ? host->num_threads : omp_get_max_threads();
    return threads < DELAUNAY__MOST_THREADS ? threads : DELAUNAY__MOST_THREADS;
#  else
    (void)host;
    return 1;
#  endif
}

DELAUNAY_API int delaunay_threads_for(const delaunay_host *host, size_t steps)
{
    return steps < 16384 ? 1 : delaunay_threads(host);
}

DELAUNAY_API double delaunay_cpu_seconds(void)
{
#  if defined(CLOCK_THREAD_CPUTIME_ID) && defined(__linux__)
    struct timespec now;
    if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0)
        return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
#  endif
    return 0;
}

DELAUNAY_API int delaunay_crew_begin(delaunay_crew *crew, int worthwhile)
{
    crew->threads = worthwhile ? delaunay_threads(crew->host) : 1;
    if (crew->threads == 1) return 1;
    crew->begin = delaunay_seconds(crew->host);
    if (crew->begin < crew->alone_until) crew->threads = 1;
    return crew->threads;
}

DELAUNAY_API void delaunay_crew_end(delaunay_crew *crew, double work)
{
    double now, lost;
    if (crew->threads == 1 || !(work > 0) || (crew->host && crew->host->clock)) return;
    now = delaunay_seconds(crew->host);
    lost = now - crew->begin - work;
    if (lost > 0) crew->alone_until = now + 10 * lost;
}

DELAUNAY_API delaunay_result delaunay_list_push(delaunay_list *list, delaunay_handle item)
{
    if (list->count == list->cap) {
        size_t cap = list->cap ? 2 * list->cap : 64;
        void *items =
            delaunay_grow(list->memory, list->items, list->count, cap, sizeof *list->items);
        if (!items) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        list->items = (delaunay_handle *)items;
        list->cap = cap;
    }
    list->items[list->count++] = item;
    return DELAUNAY_OK;
}

DELAUNAY_API void delaunay_list_free(delaunay_list *list)
{
    if (list->memory) delaunay_release(list->memory, list->items);
    list->items = NULL;
    list->count = list->cap = 0;
}

/* ---- >>predicates ------------------------------------------------------------------------- */
/* Where a floating-point filter is not certain, the sign is computed in integers, because doubles
 * are integers times powers of two: no rounding mode or overflow can change it, nor can flushing to
 * zero, if denormals are still read as what they are.
 * Differences that fit in 62 bits of a common unit (grids, CAD faces, most near ties) take the
 * short way, functions named _short; all others take the long way, functions named _long. */
#  if defined(__SIZEOF_INT128__)
__extension__ typedef __int128 delaunay__int128;
__extension__ typedef unsigned __int128 delaunay__double_limb;
typedef uint64_t delaunay__limb;
enum {
    DELAUNAY__LIMB_BITS = 64,
    DELAUNAY__BIG_LIMBS = 172
}; /* 5 factors of 2100 bits, the whole range of doubles */
#  else
typedef uint64_t delaunay__double_limb;
typedef uint32_t delaunay__limb;
enum { DELAUNAY__LIMB_BITS = 32, DELAUNAY__BIG_LIMBS = 344 };
#  endif

/* x = m * 2^e, m odd or zero; returns the number of bits of m. */
static int delaunay__decompose(double x, int64_t *m, int *e)
{
    uint64_t bits, f;
    int exponent, n = 0;
    memcpy(&bits, &x, sizeof bits);
    exponent = (int)(bits >> 52 & 0x7ff);
    f = bits & ((UINT64_C(1) << 52) - 1);
    if (exponent) f |= UINT64_C(1) << 52;
    else exponent = 1;
    *m = 0;
    *e = 0;
    if (f == 0) return 0;
    exponent -= 1075;
#  if defined(__GNUC__)
    n = __builtin_ctzll(f);
    f >>= n;
    exponent += n;
    n = 64 - __builtin_clzll(f);
#  else
    while (!(f & 1)) f >>= 1, exponent++;
    while (f >> n) n++;
#  endif
    *m = bits >> 63 ? -(int64_t)f : (int64_t)f;
    *e = exponent;
    return n;
}

/* Coordinates as m * 2^e. 2^unit, the common unit, is the lowest bit of all of them; 2^top is just
 * above the highest one. */
typedef struct delaunay__exact {
    int64_t m[15];
    int e[15];
    int unit, top;
} delaunay__exact;

static void delaunay__exact_set(delaunay__exact *x, const double *const *points, int count)
{
    int i, bits;
    x->unit = INT_MAX;
    x->top = INT_MIN;
    for (i = 0; i < 3 * count; i++) {
        bits = delaunay__decompose(points[i / 3][i % 3], &x->m[i], &x->e[i]);
        if (bits == 0) continue;
        if (x->e[i] < x->unit) x->unit = x->e[i];
        if (x->e[i] + bits > x->top) x->top = x->e[i] + bits;
    }
}

/* -- the long way: signed integers of many limbs */
typedef struct delaunay__big {
    int sign, n; /* sign 0: zero; n limbs, the last not zero */
    delaunay__limb d[DELAUNAY__BIG_LIMBS];
} delaunay__big;

static void delaunay__big_trim(delaunay__big *r)
{
    while (r->n > 0 && r->d[r->n - 1] == 0) r->n--;
    if (r->n == 0) r->sign = 0;
}

static void delaunay__big_set(delaunay__big *r, int64_t m, int shift)
{
    uint64_t f = (uint64_t)(m < 0 ? -m : m);
    int i, word = shift / DELAUNAY__LIMB_BITS, bit = shift % DELAUNAY__LIMB_BITS;
    r->sign = m < 0 ? -1 : 1;
    r->n = 0;
    if (m == 0) {
        r->sign = 0;
        return;
    }
    for (i = 0; i < word; i++) r->d[r->n++] = 0;
    r->d[r->n++] = (delaunay__limb)(f << bit);
    for (i = DELAUNAY__LIMB_BITS - bit; i < 64; i += DELAUNAY__LIMB_BITS)
        r->d[r->n++] = (delaunay__limb)(f >> i);
    delaunay__big_trim(r);
}

static int delaunay__big_compare(const delaunay__big *a, const delaunay__big *b) /* of magnitudes */
{
    int i;
    if (a->n != b->n) return a->n < b->n ? -1 : 1;
    for (i = a->n; i-- > 0;)
        if (a->d[i] != b->d[i]) return a->d[i] < b->d[i] ? -1 : 1;
    return 0;
}

/* r = a + sign*b, sign 1 or -1; r may be a */
static void delaunay__big_add(delaunay__big *r, const delaunay__big *a, const delaunay__big *b,
                              int sign)
{
    const delaunay__big *x = a, *y = b;
    int i, n, s = sign * b->sign;
    delaunay__double_limb c = 0;
    if (b->sign == 0) {
        if (r != a) memcpy(r, a, offsetof(delaunay__big, d) + (size_t)a->n * sizeof *a->d);
        return;
    }
    if (a->sign == 0) {
        memcpy(r, b, offsetof(delaunay__big, d) + (size_t)b->n * sizeof *b->d);
        r->sign = s;
        return;
    }
    if (a->sign == s) {
        n = a->n > b->n ? a->n : b->n;
        for (i = 0; i < n; i++) {
            c += (delaunay__double_limb)(i < a->n ? a->d[i] : 0) + (i < b->n ? b->d[i] : 0);
            r->d[i] = (delaunay__limb)c;
            c >>= DELAUNAY__LIMB_BITS;
        }
        r->d[n] = (delaunay__limb)c;
        r->n = n + 1;
        r->sign = s;
    } else {
        if (delaunay__big_compare(a, b) < 0) {
            x = b;
            y = a;
        } else {
            s = a->sign;
        }
        n = x->n;
        for (i = 0; i < n; i++) { /* c: borrow */
            delaunay__double_limb u = (delaunay__double_limb)(i < y->n ? y->d[i] : 0) + c;
            c = x->d[i] < u;
            r->d[i] = (delaunay__limb)(x->d[i] - u);
        }
        r->n = n;
        r->sign = s;
    }
    delaunay__big_trim(r);
}

static void delaunay__big_mul(delaunay__big *r, const delaunay__big *a, const delaunay__big *b)
{
    int i, j;
    delaunay__double_limb c;
    r->sign = a->sign * b->sign;
    r->n = 0;
    if (r->sign == 0) return;
    r->n = a->n + b->n;
    memset(r->d, 0, (size_t)r->n * sizeof *r->d);
    for (i = 0; i < a->n; i++) {
        c = 0;
        for (j = 0; j < b->n; j++) {
            c += (delaunay__double_limb)a->d[i] * b->d[j] + r->d[i + j];
            r->d[i + j] = (delaunay__limb)c;
            c >>= DELAUNAY__LIMB_BITS;
        }
        r->d[i + j] = (delaunay__limb)c;
    }
    delaunay__big_trim(r);
}

/* r = coordinate i - coordinate j */
static void delaunay__big_difference(delaunay__big *r, const delaunay__exact *x, int i, int j)
{
    delaunay__big a, b;
    delaunay__big_set(&a, x->m[i], x->e[i] - x->unit);
    delaunay__big_set(&b, x->m[j], x->e[j] - x->unit);
    delaunay__big_add(r, &a, &b, -1);
}

static void delaunay__big_det3(delaunay__big *r, const delaunay__big *a, const delaunay__big *b,
                               const delaunay__big *c)
{
    delaunay__big p, q;
    int i, j, l;
    r->sign = r->n = 0;
    for (i = 0; i < 3; i++) {
        j = (i + 1) % 3;
        l = (i + 2) % 3;
        delaunay__big_mul(&p, &b[j], &c[l]);
        delaunay__big_mul(&q, &b[l], &c[j]);
        delaunay__big_add(&p, &p, &q, -1);
        delaunay__big_mul(&q, &p, &a[i]);
        delaunay__big_add(r, r, &q, 1);
    }
}

static DELAUNAY__NOINLINE int delaunay__orient3d_long(const delaunay__exact *x)
{
    delaunay__big row[3][3], det;
    int i;
    for (i = 0; i < 9; i++) delaunay__big_difference(&row[i / 3][i % 3], x, i + 3, i % 3);
    delaunay__big_det3(&det, row[0], row[1], row[2]);
    return det.sign;
}

/* weights: five, or NULL; their unit is the square of the coordinates' unit. */
static DELAUNAY__NOINLINE int delaunay__insphere_long(const delaunay__exact *x,
                                                      const delaunay__exact *weights)
{
    delaunay__big row[4][3], sum, lift, part, det;
    int i, k;
    sum.sign = sum.n = 0;
    for (i = 0; i < 12; i++) delaunay__big_difference(&row[i / 3][i % 3], x, i, 12 + i % 3);
    for (i = 0; i < 4; i++) {
        lift.sign = lift.n = 0;
        for (k = 0; k < 3; k++) {
            delaunay__big_mul(&part, &row[i][k], &row[i][k]);
            delaunay__big_add(&lift, &lift, &part, 1);
        }
        if (weights) {
            delaunay__big_difference(&part, weights, i, 4);
            delaunay__big_add(&lift, &lift, &part, -1);
        }
        delaunay__big_det3(&det, row[(i + 1) & 3], row[(i + 2) & 3], row[(i + 3) & 3]);
        delaunay__big_mul(&part, &det, &lift);
        delaunay__big_add(&sum, &sum, &part, i & 1 ? -1 : 1);
    }
    return sum.sign;
}

/* Sign of |p1 - p0|^2 - |p2 - p0|^2. */
static DELAUNAY__NOINLINE int delaunay__compare_distance_long(const double *const *p)
{
    delaunay__exact x;
    delaunay__big sum, difference, square;
    int i;
    delaunay__exact_set(&x, p, 3);
    if (x.top == INT_MIN) return 0;
    sum.sign = sum.n = 0;
    for (i = 0; i < 6; i++) {
        delaunay__big_difference(&difference, &x, 3 + i, i % 3);
        delaunay__big_mul(&square, &difference, &difference);
        delaunay__big_add(&sum, &sum, &square, i < 3 ? 1 : -1);
    }
    return sum.sign;
}

/* -- the short way: coordinates that are integers below 2^60 if multiplied by some power of two */
#  if defined(__SIZEOF_INT128__)

/* Computes these integers. Returns 0 if the coordinates are not of this kind, or if the power of
 * two is less than 1 or greater than all doubles. */
static int delaunay__integers(const double *const *points, int count, int64_t (*m)[3])
{
    double most = 0, unit;
    uint64_t bits;
    int i, k, whole = 1;
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) {
            double x = points[i][k] < 0 ? -points[i][k] : points[i][k];
            most = most > x ? most : x;
        }
    memcpy(&bits, &most, sizeof bits);
    bits >>= 52; /* 2^(bits - 1022) is above all; times unit it is 2^60. Nothing underflows */
    if (bits < 100 || bits > 1022 + 60) return 0;
    bits = (1023 + 60 + 1022 - bits) << 52;
    memcpy(&unit, &bits, sizeof unit);
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) {
            double x = points[i][k] * unit;
            m[i][k] = (int64_t)x;
            whole &= (double)m[i][k] == x;
        }
    return whole;
}

static void delaunay__short_row(int64_t *r, const int64_t *p, const int64_t *q)
{
    int k;
    for (k = 0; k < 3; k++) r[k] = p[k] - q[k];
}

/* low + 2^64 high, high signed */
typedef struct delaunay__int192 {
    uint64_t low;
    delaunay__int128 high;
} delaunay__int192;

static delaunay__int192 delaunay__short_det3(const int64_t *a, const int64_t *b, const int64_t *c)
{
    delaunay__int192 r;
    delaunay__int128 low = 0, high = 0;
    int i, j, l;
    for (i = 0; i < 3; i++) {
        delaunay__int128 m;
        j = (i + 1) % 3;
        l = (i + 2) % 3;
        m = (delaunay__int128)b[j] * c[l] - (delaunay__int128)b[l] * c[j]; /* below 2^123 */
        low += (delaunay__int128)a[i] * (uint64_t)m;                       /* each below 2^125 */
        high += (delaunay__int128)a[i] * (int64_t)(m >> 64);
    }
    r.low = (uint64_t)low;
    r.high = high + (low >> 64);
    return r;
}

static int delaunay__orient3d_short(int64_t (*x)[3])
{
    int64_t row[3][3];
    delaunay__int192 det;
    int i;
    for (i = 0; i < 3; i++) delaunay__short_row(row[i], x[i + 1], x[0]);
    det = delaunay__short_det3(row[0], row[1], row[2]);
    return det.high < 0 ? -1 : det.high > 0 || det.low > 0;
}

static int delaunay__insphere_short(int64_t (*x)[3])
{
    int64_t row[4][3];
    delaunay__int128 sum[6] = {0, 0, 0, 0, 0, 0}, carry;
    uint64_t any = 0;
    int i, k;
    for (i = 0; i < 4; i++) delaunay__short_row(row[i], x[i], x[4]);
    for (i = 0; i < 4; i++) {
        delaunay__int128 lift = 0, part[6];
        delaunay__int192 det =
            delaunay__short_det3(row[(i + 1) & 3], row[(i + 2) & 3], row[(i + 3) & 3]);
        uint64_t d0 = det.low, d1 = (uint64_t)det.high, l0, l1;
        int64_t d2 = (int64_t)(det.high >> 64);
        for (k = 0; k < 3; k++) lift += (delaunay__int128)row[i][k] * row[i][k];
        l0 = (uint64_t)lift;
        l1 = (uint64_t)(lift >> 64);
        { /* (d0 + 2^64 d1 + 2^128 d2) * (l0 + 2^64 l1), limb by limb; l1 < 2^60, |d2| < 2^60 */
            delaunay__double_limb p00 = (delaunay__double_limb)d0 * l0,
                                  p01 = (delaunay__double_limb)d0 * l1;
            delaunay__double_limb p10 = (delaunay__double_limb)d1 * l0,
                                  p11 = (delaunay__double_limb)d1 * l1;
            delaunay__int128 p20 = (delaunay__int128)d2 * l0,
                             p21 = (delaunay__int128)d2 * (int64_t)l1;
            part[0] = (uint64_t)p00;
            part[1] = (delaunay__int128)(uint64_t)(p00 >> 64) + (uint64_t)p01 + (uint64_t)p10;
            part[2] = (delaunay__int128)(uint64_t)(p01 >> 64) + (uint64_t)(p10 >> 64) +
                      (uint64_t)p11 + (uint64_t)p20;
            part[3] = (delaunay__int128)(uint64_t)(p11 >> 64) + (p20 >> 64) + (uint64_t)p21;
            part[4] = p21 >> 64;
        }
        for (k = 0; k < 5; k++) sum[k] += i & 1 ? -part[k] : part[k];
    }
    for (k = 0, carry = 0; k < 5; k++) {
        carry += sum[k];
        any |= (uint64_t)carry;
        carry >>= 64;
    }
    return carry < 0 ? -1 : carry > 0 || any;
}
#  endif

/* The sign of delaunay_orient3d if three of the four points lie in a plane across an axis: their
 * orientation in that plane, and the side on which the fourth point lies. 2: no three points do. */
static int delaunay__orient3d_by_plane(const double *const *p)
{
    static const uint8_t others[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
    int k, i;
    for (k = 0; k < 3; k++)
        for (i = 0; i < 4; i++) {
            const double *a = p[others[i][0]], *b = p[others[i][1]], *c = p[others[i][2]];
            int side = p[i][k] > a[k] ? 1 : -1; /* used only where the caller excludes equality */
            if (a[k] != b[k] || a[k] != c[k]) continue;
            return (i & 1 ? side : -side) * delaunay_orient2d(a, b, c, k);
        }
    return 2;
}

DELAUNAY_API int delaunay_orient3d_exact(const double *a, const double *b, const double *c,
                                         const double *d)
{
    const double *p[4];
    delaunay__exact x;
    int k, sign;
    for (k = 0; k < 3; k++) /* all in a plane across an axis: common in machine parts */
        if (a[k] == b[k] && a[k] == c[k] && a[k] == d[k]) return 0;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
#  if defined(__SIZEOF_INT128__)
    {
        int64_t m[4][3];
        if (delaunay__integers(p, 4, m)) return delaunay__orient3d_short(m);
    }
#  endif
    sign = delaunay__orient3d_by_plane(p);
    if (sign != 2) return sign;
    delaunay__exact_set(&x, p, 4);
    if (x.top == INT_MIN) return 0; /* all zero */
    return delaunay__orient3d_long(&x);
}

DELAUNAY_API int delaunay_insphere_exact(const double *a, const double *b, const double *c,
                                         const double *d, const double *e)
{
    const double *p[5];
    delaunay__exact x;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    p[4] = e;
#  if defined(__SIZEOF_INT128__)
    {
        int64_t m[5][3];
        if (delaunay__integers(p, 5, m)) return delaunay__insphere_short(m);
    }
#  endif
    delaunay__exact_set(&x, p, 5);
    if (x.top == INT_MIN) return 0;
    return delaunay__insphere_long(&x, NULL);
}

static DELAUNAY__NOINLINE int delaunay__insphere_weighted_exact(const double *const *p,
                                                                const double *weights)
{
    delaunay__exact x, w;
    const double *q[2];
    double pad[6];
    memset(pad, 0, sizeof pad);
    memcpy(pad, weights, 5 * sizeof *pad);
    q[0] = pad;
    q[1] = pad + 3;
    delaunay__exact_set(&x, p, 5);
    delaunay__exact_set(&w, q, 2);
    if (x.top == INT_MIN) return 0;
    if (w.top != INT_MIN) { /* the weights must be multiples of the square of the unit */
        int half = w.unit >= 0 ? w.unit / 2 : -((1 - w.unit) / 2);
        if (half < x.unit) x.unit = half;
    }
    w.unit = 2 * x.unit;
    return delaunay__insphere_long(&x, &w);
}

static DELAUNAY__NOINLINE int delaunay__orient2d_exact(const double *a, const double *b,
                                                       const double *c, int i, int j)
{
    const double *p[3];
    delaunay__exact x;
    p[0] = a;
    p[1] = b;
    p[2] = c;
#  if defined(__SIZEOF_INT128__)
    {
        int64_t m[3][3], u[3], v[3];
        if (delaunay__integers(p, 3, m)) {
            delaunay__int128 l, r;
            delaunay__short_row(u, m[1], m[0]);
            delaunay__short_row(v, m[2], m[0]);
            l = (delaunay__int128)u[i] * v[j];
            r = (delaunay__int128)u[j] * v[i];
            return l < r ? -1 : l > r;
        }
    }
#  endif
    delaunay__exact_set(&x, p, 3);
    if (x.top == INT_MIN) return 0;
    {
        delaunay__big u, v, l, r;
        delaunay__big_difference(&u, &x, 3 + i, i);
        delaunay__big_difference(&v, &x, 6 + j, j);
        delaunay__big_mul(&l, &u, &v);
        delaunay__big_difference(&u, &x, 3 + j, j);
        delaunay__big_difference(&v, &x, 6 + i, i);
        delaunay__big_mul(&r, &u, &v);
        delaunay__big_add(&l, &l, &r, -1);
        return l.sign;
    }
}

/* Squares of bounds on the error of the in-sphere determinant. The error is at most 16 eps times
 * the permanent, which is at most 4 * 3!/3^1.5 * R^5, where R^2 is the greatest lift: 8.3e-15 R^5.
 * Underflow adds at most 1e-324 R^3 < 1e-170, because R^10 does not overflow. */
static const double delaunay__insphere_error2 = 1e-28, delaunay__insphere_least2 = 1e-290;

typedef struct delaunay__rows {
    double x[4][3], lift[4]; /* differences to e; squares of their lengths */
} delaunay__rows;

DELAUNAY_INLINE void delaunay__rows_set(delaunay__rows *r, const double *const *p, const double *e)
{
    int i;
    for (i = 0; i < 4; i++) {
        double *x = r->x[i];
        x[0] = p[i][0] - e[0], x[1] = p[i][1] - e[1], x[2] = p[i][2] - e[2];
        r->lift[i] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    }
}

/* The determinant of rows (x, lift). */
DELAUNAY_INLINE double delaunay__rows_det(const delaunay__rows *r, const double *lift)
{
    const double *a = r->x[0], *b = r->x[1], *c = r->x[2], *d = r->x[3];
    double ab = a[0] * b[1] - b[0] * a[1], bc = b[0] * c[1] - c[0] * b[1];
    double cd = c[0] * d[1] - d[0] * c[1], da = d[0] * a[1] - a[0] * d[1];
    double ac = a[0] * c[1] - c[0] * a[1], bd = b[0] * d[1] - d[0] * b[1];
    double abc = a[2] * bc - b[2] * ac + c[2] * ab, bcd = b[2] * cd - c[2] * bd + d[2] * bc;
    double cda = c[2] * da + d[2] * ac + a[2] * cd, dab = d[2] * ab + a[2] * bd + b[2] * da;
    return (lift[2] * dab - lift[3] * abc) + (lift[0] * bcd - lift[1] * cda);
}

DELAUNAY_INLINE double delaunay__insphere_bound2(const double *size)
{
    double l = size[0] > size[1] ? size[0] : size[1], m = size[2] > size[3] ? size[2] : size[3];
    l = l > m ? l : m;
    return delaunay__insphere_error2 * (l * l * l * l * l) + delaunay__insphere_least2;
}

static double delaunay__insphere_double(const double *a, const double *b, const double *c,
                                        const double *d, const double *e, double *bound2)
{
    const double *p[4];
    delaunay__rows r;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    delaunay__rows_set(&r, p, e);
    *bound2 = delaunay__insphere_bound2(r.lift);
    return delaunay__rows_det(&r, r.lift);
}

/* With weights a lift goes through one more rounding, and its error is relative to the sum of the
 * absolute values of its terms: 17 eps. */
static double delaunay__insphere_weighted_double(const double *const *p, const double *weights,
                                                 double *bound2)
{
    delaunay__rows r;
    double lift[4];
    int i;
    delaunay__rows_set(&r, p, p[4]);
    for (i = 0; i < 4; i++) {
        double w = weights[i] - weights[4];
        lift[i] = r.lift[i] - w;
        r.lift[i] += fabs(w);
    }
    *bound2 = delaunay__insphere_bound2(r.lift);
    return delaunay__rows_det(&r, lift);
}

DELAUNAY_API int delaunay_insphere(const double *a, const double *b, const double *c,
                                   const double *d, const double *e)
{
    double bound2, det = delaunay__insphere_double(a, b, c, d, e, &bound2);
    if (det * det > bound2) return det > 0 ? 1 : -1;
    return delaunay_insphere_exact(a, b, c, d, e);
}

static int delaunay__lexicographic_less(const double *a, const double *b)
{
    return a[0] != b[0] ? a[0] < b[0] : a[1] != b[1] ? a[1] < b[1] : a[2] < b[2];
}

/* The lifting of every point is raised by an infinitesimal, most for the lexicographically greatest
 * point, infinitely less for each next one. So the first nonzero cofactor decides: that of the
 * greatest point, or else of the second greatest; for distinct points two steps are enough. If it
 * is the turn of e, it is raised most and lies outside. An e equal to another point is never
 * inside. */
static int delaunay__insphere_tie(const double *a, const double *b, const double *c,
                                  const double *d, const double *e)
{
    const double *p[5], *s[4];
    int first = 4, second = 4, i, k, o;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    p[4] = e;
    for (i = 0; i < 4; i++)
        if (delaunay__lexicographic_less(p[first], p[i])) first = i;
    for (i = 0; i < 4; i++)
        if (i != first && delaunay__lexicographic_less(p[second], p[i])) second = i;
    for (k = 0; k < 2; k++) {
        i = k ? second : first;
        if (i == 4) return -1;
        memcpy(s, p, sizeof s);
        s[i] = e;
        o = delaunay_orient3d(s[0], s[1], s[2], s[3]);
        if (o) return o;
    }
    return 0;
}

DELAUNAY_API int delaunay_insphere_perturbed(const double *a, const double *b, const double *c,
                                             const double *d, const double *e)
{
    int s = delaunay_insphere(a, b, c, d, e);
    return s ? s : delaunay__insphere_tie(a, b, c, d, e);
}

static int delaunay__insphere_of(const double *const *p, const double *weights)
{
    double bound2, det = delaunay__insphere_weighted_double(p, weights, &bound2);
    if (det * det > bound2) return det > 0 ? 1 : -1;
    return delaunay__insphere_weighted_exact(p, weights);
}

DELAUNAY_API int delaunay_insphere_weighted(const double *a, const double *b, const double *c,
                                            const double *d, const double *e, const double *weights)
{
    const double *p[5];
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    p[4] = e;
    return delaunay__insphere_of(p, weights);
}

/* As delaunay__insphere_tie, but the cofactors of several points may be zero: up to five steps. */
DELAUNAY_API int delaunay_insphere_weighted_perturbed(const double *a, const double *b,
                                                      const double *c, const double *d,
                                                      const double *e, const double *weights)
{
    const double *p[5], *s[4];
    int used = 0, i, k, o = delaunay_insphere_weighted(a, b, c, d, e, weights);
    if (o) return o;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    p[4] = e;
    for (k = 0; k < 5; k++) {
        int greatest = -1;
        for (i = 4; i >= 0; i--)
            if (!(used >> i & 1) &&
                (greatest < 0 || delaunay__lexicographic_less(p[greatest], p[i])))
                greatest = i;
        if (greatest == 4) break;
        used |= 1 << greatest;
        memcpy(s, p, sizeof s);
        s[greatest] = e;
        o = delaunay_orient3d(s[0], s[1], s[2], s[3]);
        if (o) return o;
    }
    return -1;
}

/* Filter: four roundings, each by at most half an ulp of a product or of the result. */
DELAUNAY_API int delaunay_orient2d(const double *a, const double *b, const double *c, int axis)
{
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    double l = (b[i] - a[i]) * (c[j] - a[j]), r = (b[j] - a[j]) * (c[i] - a[i]), det = l - r;
    if (fabs(det) > 5e-16 * (fabs(l) + fabs(r)) + 1e-290) return det > 0 ? 1 : -1;
    return delaunay__orient2d_exact(a, b, c, i, j);
}

/* Filter: ten roundings at most, each half an ulp of a sum of squares. */
DELAUNAY_API int delaunay_compare_distance(const double *q, const double *a, const double *b)
{
    double ax = a[0] - q[0], ay = a[1] - q[1], az = a[2] - q[2];
    double bx = b[0] - q[0], by = b[1] - q[1], bz = b[2] - q[2];
    double l = ax * ax + ay * ay + az * az, r = bx * bx + by * by + bz * bz;
    const double *p[3];
    if (fabs(l - r) > 2e-15 * (l + r) + 1e-290 && l + r < 1e300) return l < r ? -1 : 1;
    p[0] = q;
    p[1] = a;
    p[2] = b;
    return delaunay__compare_distance_long(p);
}

DELAUNAY_API int delaunay_collinear(const double *a, const double *b, const double *c)
{
    return !delaunay_orient2d(a, b, c, 0) && !delaunay_orient2d(a, b, c, 1) &&
           !delaunay_orient2d(a, b, c, 2);
}

/* Near ties for every stage of the filters: points that would lie on a sphere if their coordinates
 * were not rounded. They are triangulated, and the result is validated, which uses the public
 * predicates instead of those of the insertion. */
static delaunay_result delaunay__selftest_mesh(void)
{
    static const double on[4][3] = {{8, 4, 1}, {7, 4, 4}, {6, 6, 3}, {9, 0, 0}}; /* 9^2 */
    double xyz[3 * 4 * 24];
    delaunay_mesh mesh;
    delaunay_options options;
    delaunay_result result;
    int i, k, n = 0;
    memset(&mesh, 0, sizeof mesh);
    memset(&options, 0, sizeof options);
    options.host.num_threads = 1;
    for (i = 0; i < 4 * 24; i++, n++)
        for (k = 0; k < 3; k++) {
            double x = on[i / 24][(k + i % 3) % 3];
            xyz[3 * n + k] = 0.1 * ((i / 3 >> k & 1) ? -x : x) + 0.3;
        }
    result = delaunay_tetrahedralize(&mesh, xyz, (size_t)n, &options, NULL);
    if (result == DELAUNAY_OK) result = delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL);
    delaunay_mesh_free(&mesh);
    if (result == DELAUNAY_OK || result == DELAUNAY_ERROR_OUT_OF_MEMORY) return result;
    return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
}

/* Tests values and signs that are wrong if the compiler reorders sums or the processor keeps excess
 * precision or flushes small numbers to zero. */
DELAUNAY_API delaunay_result delaunay_selftest(void)
{
    volatile double one = 1, tiny = DBL_MIN, e = DBL_EPSILON / 2, big = 4503599627370497.0;
    double a[3] = {0, 0, 0}, b[3] = {1, 0, 0}, c[3] = {0, 1, 0}, d[3] = {0, 0, 1}, q[3] = {1, 1, 1};
    double s = one + e, t = s - one, distant[3];
    int i;
    if (s != 1 || t != 0 || tiny * 0.5 == 0 || (one + 1.5 * e) - one == 0)
        return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
    if ((big + 0.25) - big != 0) return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
    if (delaunay_orient3d(a, b, c, d) != 1 || delaunay_orient3d(a, c, b, d) != -1)
        return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
    if (delaunay_insphere(a, b, c, d, q) != 0) return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
    for (i = 0; i < 3; i++) { /* one unit in the last place on either side of the sphere */
        memcpy(distant, q, sizeof distant);
        distant[i] = one + 2 * e;
        if (delaunay_insphere(a, b, c, d, distant) != -1) return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
        distant[i] = one - e;
        if (delaunay_insphere(a, b, c, d, distant) != 1) return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
    }
    for (i = 0; i < 3; i++) { /* 0.1 + 0.2 != 0.3 */
        a[i] = (double)i * 0.1;
        b[i] = (double)i * 0.1 + one;
        c[i] = (double)(i * i);
        d[i] = 2 * b[i] - a[i];
    }
    if (delaunay_orient3d(a, b, c, d) != delaunay_orient3d_exact(a, b, c, d))
        return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
    for (i = 0; i < 3; i++) a[i] = 0.5 + e * i, b[i] = 12.0 + e, c[i] = 24.0 - e;
    d[0] = d[1] = 0.5;
    d[2] = 0.5 + 2 * e;
    if (delaunay_orient3d(a, b, c, d) != delaunay_orient3d_exact(a, b, c, d))
        return DELAUNAY_ERROR_BROKEN_ARITHMETIC;
    return delaunay__selftest_mesh();
}

/* ---- >>mesh ------------------------------------------------------------------------------- */

DELAUNAY_API void delaunay_mesh_free(delaunay_mesh *mesh)
{
    delaunay_memory *m;
    if (!mesh) return;
    m = &mesh->memory;
    if (m->allocator.release) {
        delaunay_release(m, mesh->vertices);
        delaunay_release(m, mesh->vertex_id);
        delaunay_release(m, mesh->weight);
        delaunay_release(m, mesh->vertex_tet);
        delaunay_release(m, mesh->tets);
        delaunay_release(m, mesh->flags);
        delaunay_release(m, mesh->color);
        delaunay_release(m, mesh->mark);
        delaunay_release(m, mesh->free_tets);
        delaunay_release(m, mesh->vertex_of);
    }
    memset(mesh, 0, sizeof *mesh);
}

/* Grows one array of a mesh from used to cap elements, the new ones zeroed. */
#  define DELAUNAY__GROW(type, field, used, cap)                                                   \
    do {                                                                                           \
      type *grown_ =                                                                               \
          (type *)delaunay_grow_zeroed(&mesh->memory, mesh->field, (used), (cap), sizeof(type));   \
      if (!grown_) return DELAUNAY_ERROR_OUT_OF_MEMORY;                                            \
      mesh->field = grown_;                                                                        \
    } while (0)

static delaunay_result delaunay__reserve_vertices(delaunay_mesh *mesh, size_t vertices)
{
    size_t used = mesh->num_vertices;
    if (vertices <= mesh->cap_vertices) return DELAUNAY_OK;
    if (vertices >= UINT32_MAX) return DELAUNAY_ERROR_TOO_LARGE;
    DELAUNAY__GROW(delaunay_vertex, vertices, used, vertices);
    DELAUNAY__GROW(uint32_t, vertex_id, used, vertices);
    if (mesh->weight) DELAUNAY__GROW(double, weight, used, vertices);
    if (mesh->vertex_tet) DELAUNAY__GROW(delaunay_handle, vertex_tet, used, vertices);
    mesh->cap_vertices = (uint32_t)vertices;
    return DELAUNAY_OK;
}

/* Slots that are not in use are not initialised: memory that is never touched costs nothing. */
static delaunay_result delaunay__reserve_tets(delaunay_mesh *mesh, size_t tets)
{
    size_t used = mesh->num_tets;
    delaunay_tet *grown;
    if (tets <= mesh->cap_tets) return DELAUNAY_OK;
    if (tets >= (size_t)((delaunay_handle)-1) / 4) return DELAUNAY_ERROR_TOO_LARGE;
    grown = (delaunay_tet *)delaunay_grow(&mesh->memory, mesh->tets, used, tets, sizeof *grown);
    if (!grown) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    if (used == 0) memset((void *)grown, 0, sizeof *grown); /* the dummy */
    mesh->tets = grown;
    DELAUNAY__GROW(uint8_t, mark, used, tets);
    if (mesh->flags) DELAUNAY__GROW(uint16_t, flags, used, tets);
    if (mesh->color) DELAUNAY__GROW(uint32_t, color, used, tets);
    mesh->cap_tets = (delaunay_handle)tets;
    return DELAUNAY_OK;
}

/* Room for at least so many slots, better for more: as many as handles can name, if need be. */
static delaunay_result delaunay__grow_tets(delaunay_mesh *mesh, size_t least, size_t better)
{
    size_t most = (size_t)((delaunay_handle)-1) / 4 - 1;
    if (better > most) better = most;
    return delaunay__reserve_tets(mesh, better > least ? better : least);
}

DELAUNAY_API delaunay_result delaunay_reserve(delaunay_mesh *mesh, size_t vertices, size_t tets)
{
    delaunay_result result = DELAUNAY_OK;
    if (!mesh->memory.allocator.alloc) result = delaunay_memory_init(&mesh->memory, NULL);
    if (result == DELAUNAY_OK)
        result = delaunay__reserve_vertices(mesh, vertices < 1 ? 1 : vertices);
    if (result == DELAUNAY_OK) result = delaunay__reserve_tets(mesh, tets < 1 ? 1 : tets);
    if (result != DELAUNAY_OK) return result;
    if (mesh->num_vertices == 0) { /* the ghost */
        mesh->num_vertices = 1;
        mesh->vertex_id[0] = DELAUNAY_NO_ID;
    }
    if (mesh->num_tets == 0) mesh->num_tets = 1; /* the dummy */
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_enable_marks(delaunay_mesh *mesh)
{
    size_t cap = mesh->cap_tets;
    if (!mesh->flags) DELAUNAY__GROW(uint16_t, flags, 0, cap);
    if (!mesh->color) DELAUNAY__GROW(uint32_t, color, 0, cap);
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_link_vertices(delaunay_mesh *mesh)
{
    size_t cap = mesh->cap_vertices;
    delaunay_handle t;
    int i;
    if (!mesh->vertex_tet) DELAUNAY__GROW(delaunay_handle, vertex_tet, 0, cap);
    else memset(mesh->vertex_tet, 0, cap * sizeof *mesh->vertex_tet);
    for (t = mesh->num_tets; t-- > 1;)
        if (!delaunay_is_deleted(mesh, t))
            for (i = 0; i < 4; i++) mesh->vertex_tet[mesh->tets[t].v[i]] = t;
    return DELAUNAY_OK;
}

DELAUNAY_API uint32_t delaunay_add_vertex(delaunay_mesh *mesh, const double *xyz, uint32_t id)
{
    uint32_t v;
    if (mesh->num_vertices == 0 && delaunay_reserve(mesh, 64, 1) != DELAUNAY_OK) return 0;
    v = mesh->num_vertices;
    if (v == mesh->cap_vertices) {
        size_t cap = (size_t)v + v / 2 + 64;
        if (cap >= UINT32_MAX) cap = UINT32_MAX - 1;
        if (delaunay__reserve_vertices(mesh, cap) != DELAUNAY_OK) return 0;
    }
    mesh->num_vertices++;
    memcpy(mesh->vertices[v].x, xyz, 3 * sizeof *xyz);
    mesh->vertices[v].key = mesh->vertices[v].local = 0;
    mesh->vertex_id[v] = id;
    if (mesh->weight) mesh->weight[v] = 0;
    if (mesh->vertex_tet) mesh->vertex_tet[v] = 0;
    return v;
}

DELAUNAY_API uint64_t delaunay_count_tets(const delaunay_mesh *mesh)
{
    uint64_t n = 0;
    delaunay_handle t;
    if (!mesh) return 0;
    for (t = 1; t < mesh->num_tets; t++)
        n += !delaunay_is_deleted(mesh, t) && !delaunay_is_ghost(mesh, t);
    return n;
}

static const double *delaunay__corner(const delaunay_mesh *mesh, delaunay_handle t, int i)
{
    return mesh->vertices[mesh->tets[t].v[i]].x;
}

/* ---- >>insertion  walk, cavity, ball [Marot 2020, 3.3-3.7] --------------------------------- */
/* The cavity of a point is the set of tetrahedra in conflict with it (see delaunay__in_conflict);
 * its ball is the set of new tetrahedra that fill the cavity. A kernel is what one thread needs to
 * insert points. The slots of a cavity go to freed, last in first out, and the next ball takes its
 * slots from there. */
typedef struct delaunay__claims delaunay__claims;

struct delaunay_section {
    delaunay_mesh *mesh;
    delaunay_memory *memory;
    delaunay_vertex *vertices; /* these are copies of the mesh's pointers */
    delaunay_tet *tets;
    uint8_t *mark;
    const double *weight; /* NULL: none */
    delaunay_handle hint; /* a tetrahedron of the last ball */
    int exact_doubles;    /* in-sphere determinants are exact in doubles */
    int simd;
    int doubts;             /* grows when digging (delaunay__dig_in) fails, else falls */
    int dug;                /* the cavity was dug: no ghosts, and only its tetrahedra are marked */
    int parallel;           /* other threads are at work: stay in the section, allocate nothing */
    uint32_t start, length; /* the section: so many keys from start on, modulo 2^32 */
    delaunay__claims *claims; /* instead of a section: cells that it has claimed; NULL: none */
    int needs_memory;       /* an array was too small in the last parallel region */
    int needs_slots;        /* and that was the array of tetrahedra */
    size_t reserve; /* slots that all threads may draw after a look at their counter */
    int worker;
    delaunay_handle *queue, *cavity, *border,
        *again; /* of the cavity's search: cap_search each, in one block */
    size_t cap_search, num_cavity, num_border;
    delaunay_handle *freed;
    size_t num_freed, cap_freed;
    delaunay_handle fresh, fresh_end; /* slots dealt to it that are not in use yet */
    delaunay_handle *edges; /* matrix of a ball's directed edges: the facet of the ball at each */
    uint16_t (*edge_keys)[4]; /* of each tetrahedron of the ball: where its neighbours are there */
};
typedef struct delaunay_section delaunay__kernel;

enum {
    DELAUNAY__MATRIX_BITS = 7, /* at most 128 vertices in the matrix */
    DELAUNAY__MATRIX_CAVITY = 124, /* tetrahedra: each brings a vertex, the first one four */
    DELAUNAY__MATRIX_FACETS = 256,
    DELAUNAY__SEARCH_SLACK = 64,
    DELAUNAY__MARK_SEEN = 1,
    DELAUNAY__MARK_CAVITY = 3,
    DELAUNAY__MARK_DUG = 128
};

/* Several threads may access marks and the slot counter at the same time; their order does not
 * matter. Claims are acquired and released. */
#  if DELAUNAY__PARALLEL
#    define DELAUNAY__LOAD(p)         __atomic_load_n((p), __ATOMIC_RELAXED)
#    define DELAUNAY__STORE(p, x)     __atomic_store_n((p), (x), __ATOMIC_RELAXED)
#    define DELAUNAY__FETCH_ADD(p, x) __atomic_fetch_add((p), (x), __ATOMIC_RELAXED)
#    define DELAUNAY__RELEASE(p, x)   __atomic_store_n((p), (x), __ATOMIC_RELEASE)
#    define DELAUNAY__EXCHANGE(p, old, x)                                                          \
      __atomic_compare_exchange_n((p), (old), (x), 0, __ATOMIC_ACQUIRE, __ATOMIC_RELAXED)
#  else
#    define DELAUNAY__LOAD(p)     (*(p))
#    define DELAUNAY__STORE(p, x) ((void)(*(p) = (x)))
#    define DELAUNAY__RELEASE(p, x)       ((void)(*(p) = (x)))
#    define DELAUNAY__EXCHANGE(p, old, x) (*(p) == *(old) ? (*(p) = (x), 1) : 0)
#  endif

/* Return values in addition to those of delaunay_result. */
enum {
    DELAUNAY__NOT_HERE = 100, /* the seed of a cavity is not in conflict with the point */
    DELAUNAY__FOREIGN,        /* a tetrahedron is not in the section */
    DELAUNAY__NOT_SURE,       /* digging has failed: the general search must follow */
    DELAUNAY__NEEDS_MEMORY    /* an array is too small, and cannot grow in a parallel region */
};

/* Vertices with the same key form a cell. Cells that a kernel has claimed serve as its section, one
 * that grows while other threads are at work. */
enum { DELAUNAY__MOST_CLAIMS = 1000 };

struct delaunay__claims {
    uint16_t *owner; /* of each cell, 0: nobody; shared by all kernels */
    uint16_t own; /* the kernel's number in owner; there are 1024 threads at most */
    uint32_t num, enough; /* cells claimed; more than enough are let go after an insertion */
    uint32_t cell[DELAUNAY__MOST_CLAIMS];
};

/* Claims a cell for the kernel. From then on it sees what other threads wrote there. Returns 0 if
 * another kernel has the cell, or if there is no room for more claims. */
DELAUNAY_INLINE int delaunay__claim_cell(delaunay__claims *claims, uint32_t cell)
{
    uint16_t nobody = 0, owner = DELAUNAY__LOAD(&claims->owner[cell]);
    if (owner == claims->own) return 1;
    if (owner || claims->num == DELAUNAY__MOST_CLAIMS ||
        !DELAUNAY__EXCHANGE(&claims->owner[cell], &nobody, claims->own))
        return 0;
    claims->cell[claims->num++] = cell;
    return 1;
}

/* Releases the cells claimed, except for those of the vertices of tetrahedron hint, where the next
 * walk begins (DELAUNAY_NONE: releases all of them). */
static void delaunay__let_go(delaunay__kernel *k, delaunay_handle hint)
{
    delaunay__claims *claims = k->claims;
    const uint32_t *v = k->tets[hint].v;
    uint32_t i, kept = 0;
    for (i = 0; i < claims->num; i++) {
        const uint32_t cell = claims->cell[i];
        int j, keep = 0;
        for (j = 0; j < 4 && hint; j++)
            keep |= v[j] != DELAUNAY_GHOST && k->vertices[v[j]].key == cell;
        if (keep) claims->cell[kept++] = cell;
        else DELAUNAY__RELEASE(&claims->owner[cell], 0);
    }
    claims->num = kept;
}

static int delaunay__is_foreign(const delaunay__kernel *k, uint32_t v)
{
    if (v == DELAUNAY_GHOST) return 0;
    if (k->claims) return !delaunay__claim_cell(k->claims, k->vertices[v].key);
    return (uint32_t)(k->vertices[v].key - k->start) >= k->length;
}

static int delaunay__is_foreign_tet(const delaunay__kernel *k, delaunay_handle t)
{
    const uint32_t *v = k->tets[t].v;
    return delaunay__is_foreign(k, v[0]) || delaunay__is_foreign(k, v[1]) ||
           delaunay__is_foreign(k, v[2]) || delaunay__is_foreign(k, v[3]);
}

/* The vertex opposite facet h in the tetrahedron of h. */
static uint32_t delaunay__apex(const delaunay__kernel *k, delaunay_handle h)
{
    return k->tets[h >> 2].v[h & 3];
}

static delaunay_result delaunay__kernel_grow_search(delaunay__kernel *k)
{
    size_t cap = k->cap_search ? 2 * k->cap_search : 2048, i;
    delaunay_handle *block = (delaunay_handle *)delaunay_alloc(k->memory, cap, 4 * sizeof *block);
    delaunay_handle *old[4];
    if (!block) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    old[0] = k->queue;
    old[1] = k->cavity;
    old[2] = k->border;
    old[3] = k->again;
    for (i = 0; i < 4; i++)
        if (k->cap_search) memcpy(block + i * cap, old[i], k->cap_search * sizeof *block);
    delaunay_release(k->memory, k->queue);
    k->queue = block;
    k->cavity = block + cap;
    k->border = block + 2 * cap;
    k->again = block + 3 * cap;
    k->cap_search = cap;
    return DELAUNAY_OK;
}

static delaunay_result delaunay__kernel_reserve_freed(delaunay__kernel *k, size_t count)
{
    size_t cap = 2 * count + 1024;
    void *grown;
    if (count <= k->cap_freed) return DELAUNAY_OK;
    grown = delaunay_grow(k->memory, k->freed, k->num_freed, cap, sizeof *k->freed);
    if (!grown) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    k->freed = (delaunay_handle *)grown;
    k->cap_freed = cap;
    return DELAUNAY_OK;
}

static void delaunay__kernel_view(delaunay__kernel *k)
{
    k->vertices = k->mesh->vertices;
    k->tets = k->mesh->tets;
    k->mark = k->mesh->mark;
    k->weight = k->mesh->weight;
}

static delaunay_result delaunay__kernel_init(delaunay__kernel *k, delaunay_mesh *mesh)
{
    memset(k, 0, sizeof *k);
    k->mesh = mesh;
    k->memory = &mesh->memory;
    delaunay__kernel_view(k);
#  if defined(DELAUNAY__AVX2)
    k->simd = DELAUNAY__AVX2;
#  endif
    k->edges = (delaunay_handle *)delaunay_alloc(k->memory, (size_t)1 << 2 * DELAUNAY__MATRIX_BITS,
                                                 sizeof *k->edges);
    k->edge_keys =
        (uint16_t(*)[4])delaunay_alloc(k->memory, DELAUNAY__MATRIX_FACETS, sizeof *k->edge_keys);
    if (!k->edges || !k->edge_keys || delaunay__kernel_grow_search(k) != DELAUNAY_OK)
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    return DELAUNAY_OK;
}

static void delaunay__kernel_free(delaunay__kernel *k)
{
    if (!k->memory) return;
    delaunay_release(k->memory, k->queue);
    delaunay_release(k->memory, k->freed);
    delaunay_release(k->memory, k->edges);
    delaunay_release(k->memory, k->edge_keys);
    memset(k, 0, sizeof *k);
}

/* Gives the kernel's freed slots to the mesh, as deleted ones. */
static delaunay_result delaunay__kernel_finish(delaunay__kernel *k)
{
    delaunay_mesh *mesh = k->mesh;
    size_t i, total = (size_t)mesh->num_free + k->num_freed;
    if (total > mesh->cap_free) {
        void *grown = delaunay_grow(&mesh->memory, mesh->free_tets, mesh->num_free, total,
                                    sizeof *mesh->free_tets);
        if (!grown) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        mesh->free_tets = (delaunay_handle *)grown;
        mesh->cap_free = (delaunay_handle)total;
    }
    for (i = k->num_freed; i-- > 0;) mesh->free_tets[mesh->num_free++] = k->freed[i];
    k->num_freed = 0;
    return DELAUNAY_OK;
}

/* The perturbed in-sphere sign of vertex q for a real tetrahedron v of a weighted mesh. */
static int delaunay__in_sphere_weighted(const delaunay_vertex *x, const double *weight,
                                        const uint32_t *v, uint32_t q)
{
    double w[5];
    int i;
    for (i = 0; i < 4; i++) w[i] = weight[v[i]];
    w[4] = weight[q];
    return delaunay_insphere_weighted_perturbed(x[v[0]].x, x[v[1]].x, x[v[2]].x, x[v[3]].x, x[q].x,
                                                w);
}

static int delaunay__in_conflict_weighted(const delaunay__kernel *k, delaunay_handle t, uint32_t q)
{
    const delaunay_vertex *x = k->vertices;
    const uint32_t *v = k->tets[t].v;
    if (v[3] == DELAUNAY_GHOST) {
        int s = delaunay_orient3d(x[v[0]].x, x[v[1]].x, x[v[2]].x, x[q].x);
        if (s) return s > 0;
        t = k->tets[t].n[3] >> 2;
        if (t == DELAUNAY_NONE) return 0;
        v = k->tets[t].v;
    }
    return delaunay__in_sphere_weighted(x, k->weight, v, q) > 0;
}

/* delaunay__insphere_tie for coordinates whose differences are small integers in some unit, so that
 * all of this is exact. The rank 2^20 x + 2^10 y + z of a difference has its lexicographic sign and
 * order. */
static int delaunay__insphere_tie_doubles(const double *const *p, const double *e)
{
    delaunay__rows r;
    double rank[4];
    int i, k;
    delaunay__rows_set(&r, p, e);
    for (i = 0; i < 4; i++)
        rank[i] = 1048576 * r.x[i][0] + 1024 * r.x[i][1] + r.x[i][2];
    for (k = 0; k < 2; k++) {
        const double *a, *b, *c;
        double det;
        int m = rank[1] > rank[0], n = 2 + (rank[3] > rank[2]);
        m = rank[n] > rank[m] ? n : m;
        if (rank[m] <= 0) return -1; /* e is the greatest */
        a = r.x[m == 0];
        b = r.x[m <= 1 ? 2 : 1];
        c = r.x[m <= 2 ? 3 : 2];
        det = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
              a[2] * (b[0] * c[1] - b[1] * c[0]);
        if (det != 0) return (det > 0) == !(m & 1) ? 1 : -1;
        rank[m] = -1;
    }
    return 0;
}

/* Whether point e is in conflict with tetrahedron t: inside its sphere or, if t is a ghost, beyond
 * its hull facet, or in the plane of that facet and inside the sphere of the tetrahedron behind it.
 * Exact, with ties broken by the perturbation. */
static DELAUNAY__NOINLINE int delaunay__in_conflict_exact(const delaunay__kernel *k,
                                                          delaunay_handle t, const double *e)
{
    const delaunay_vertex *x = k->vertices;
    const uint32_t *v = k->tets[t].v;
    const double *p[4];
    int s, i;
    if (v[3] == DELAUNAY_GHOST) {
        s = delaunay_orient3d(x[v[0]].x, x[v[1]].x, x[v[2]].x, e);
        if (s) return s > 0;
        t = k->tets[t].n[3] >> 2;
        if (t == DELAUNAY_NONE) return 0;
        v = k->tets[t].v;
    }
    for (i = 0; i < 4; i++) p[i] = x[v[i]].x;
    if (k->exact_doubles) {
        double bound2, det = delaunay__insphere_double(p[0], p[1], p[2], p[3], e, &bound2);
        if (det != 0) return det > 0;
        return delaunay__insphere_tie_doubles(p, e) > 0;
    }
    s = delaunay_insphere_exact(p[0], p[1], p[2], p[3], e);
    if (s == 0) s = delaunay__insphere_tie(p[0], p[1], p[2], p[3], e);
    return s > 0;
}

static int delaunay__in_conflict(const delaunay__kernel *k, delaunay_handle t, const double *e)
{
    const delaunay_vertex *x = k->vertices;
    const uint32_t *v = k->tets[t].v;
    if (v[3] != DELAUNAY_GHOST) {
        double bound2,
            det = delaunay__insphere_double(x[v[0]].x, x[v[1]].x, x[v[2]].x, x[v[3]].x, e, &bound2);
        if (det * det > bound2) return det > 0;
    }
    return delaunay__in_conflict_exact(k, t, e);
}

/* Bit i: the tetrahedron of facet handle h[i] is in conflict with e. */
static unsigned delaunay__in_conflict_plain(const delaunay__kernel *k, const delaunay_handle *h,
                                            unsigned count, const double *e)
{
    unsigned i, in = 0;
    for (i = 0; i < count; i++) in |= (unsigned)delaunay__in_conflict(k, h[i] >> 2, e) << i;
    return in;
}

static double delaunay__orient3d_double(const double *a, const double *b, const double *c,
                                        const double *d)
{
    double bx = b[0] - a[0], by = b[1] - a[1], bz = b[2] - a[2];
    double cx = c[0] - a[0], cy = c[1] - a[1], cz = c[2] - a[2];
    double dx = d[0] - a[0], dy = d[1] - a[1], dz = d[2] - a[2];
    return bx * (cy * dz - cz * dy) + by * (cz * dx - cx * dz) + bz * (cx * dy - cy * dx);
}

/* Walks from t, which is not a ghost, towards e. The signs are not filtered and may be wrong; the
 * caller must test whether the result is in conflict. In a parallel region the result is 0 if the
 * walk leaves the section. */
static delaunay_handle delaunay__walk(const delaunay__kernel *k, delaunay_handle t, const double *e)
{
    const delaunay_vertex *x = k->vertices;
    int steps, i, from = 4;
    for (steps = 0; steps < 1000; steps++) {
        const uint32_t *v = k->tets[t].v;
        delaunay_handle h;
        if (v[3] == DELAUNAY_GHOST) return t;
        for (i = 0; i < 4; i++) {
            const uint8_t *f = delaunay_facet_vertices[i];
            if (i != from &&
                delaunay__orient3d_double(e, x[v[f[0]]].x, x[v[f[1]]].x, x[v[f[2]]].x) < 0)
                break;
        }
        if (i == 4) return t;
        h = k->tets[t].n[i];
        if (k->parallel && delaunay__is_foreign(k, delaunay__apex(k, h))) return DELAUNAY_NONE;
        t = h >> 2;
        from = (int)(h & 3);
    }
    return t;
}

/* The stochastic visibility walk with exact signs. In a Delaunay triangulation it always ends at a
 * tetrahedron that contains e, or at a ghost. */
static delaunay_handle delaunay__walk_exact(const delaunay__kernel *k, delaunay_handle t,
                                            const double *e, uint32_t seed)
{
    const delaunay_vertex *x = k->vertices;
    uint64_t steps = 0, most = 16 * (uint64_t)k->mesh->cap_tets + 1000;
    for (; steps < most; steps++) {
        const uint32_t *v = k->tets[t].v;
        unsigned i, j;
        if (v[3] == DELAUNAY_GHOST) return t;
        seed = seed * 1664525u + 1013904223u;
        for (i = 0; i < 4; i++) {
            const uint8_t *f;
            j = (i + (seed >> 30)) & 3;
            f = delaunay_facet_vertices[j];
            if (delaunay_orient3d(e, x[v[f[0]]].x, x[v[f[1]]].x, x[v[f[2]]].x) < 0) break;
        }
        if (i == 4) return t;
        if (k->parallel && delaunay__is_foreign(k, delaunay__apex(k, k->tets[t].n[j])))
            return DELAUNAY_NONE;
        t = k->tets[t].n[j] >> 2;
        if (t == DELAUNAY_NONE) return t;
    }
    return t;
}

/* -- the same for four tetrahedra at a time, where the processor has AVX2 */
#  if defined(DELAUNAY__AVX2)
/* X, Y, Z: the coordinates of vertices p, q, r, s, a lane for each vertex. */
#    define DELAUNAY__TRANSPOSE(p, q, r, s, X, Y, Z)                                               \
      do {                                                                                         \
        __m256d p_ = _mm256_loadu_pd(x[p].x), q_ = _mm256_loadu_pd(x[q].x);                        \
        __m256d r_ = _mm256_loadu_pd(x[r].x), s_ = _mm256_loadu_pd(x[s].x);                        \
        __m256d a_ = _mm256_unpacklo_pd(p_, q_), b_ = _mm256_unpackhi_pd(p_, q_);                  \
        __m256d c_ = _mm256_unpacklo_pd(r_, s_), d_ = _mm256_unpackhi_pd(r_, s_);                  \
        X = _mm256_permute2f128_pd(a_, c_, 0x20);                                                  \
        Y = _mm256_permute2f128_pd(b_, d_, 0x20);                                                  \
        Z = _mm256_permute2f128_pd(a_, c_, 0x31);                                                  \
      } while (0)
#    define DELAUNAY__MADD(a, b, c)  _mm256_fmadd_pd(a, b, c)  /* ab + c */
#    define DELAUNAY__MSUB(a, b, c)  _mm256_fmsub_pd(a, b, c)  /* ab - c */
#    define DELAUNAY__NMADD(a, b, c) _mm256_fnmadd_pd(a, b, c) /* c - ab */

/* Bit i: lane i of a is greater than that of b. */
DELAUNAY__TARGET DELAUNAY_INLINE unsigned delaunay__greater4(__m256d a, __m256d b)
{
    return (unsigned)_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_GT_OQ));
}

/* Four numbers, each as h + l [Dekker 1971]: h is the result of plain arithmetic, l collects its
 * rounding errors. They are never renormalised: l stays below a few eps times the sum of the
 * absolute values of all products so far, and its own error below some eps^2 times that sum. */
typedef struct delaunay__dd4 {
    __m256d h, l;
} delaunay__dd4;

DELAUNAY__TARGET DELAUNAY_INLINE delaunay__dd4 delaunay__dd_difference(__m256d a, __m256d b)
{
    delaunay__dd4 r;
    __m256d t;
    r.h = _mm256_sub_pd(a, b);
    t = _mm256_sub_pd(r.h, a);
    r.l = _mm256_sub_pd(_mm256_sub_pd(a, _mm256_sub_pd(r.h, t)), _mm256_add_pd(b, t));
    return r;
}

/* The asm keeps compilers that contract intrinsics, too (-ffp-contract=fast), from fusing the
 * product into a later sum: l is the error of the rounded product. */
DELAUNAY__TARGET DELAUNAY_INLINE delaunay__dd4 delaunay__dd_mul(delaunay__dd4 a, delaunay__dd4 b)
{
    delaunay__dd4 r;
    r.h = _mm256_mul_pd(a.h, b.h);
    __asm__("" : "+x"(r.h));
    r.l = DELAUNAY__MSUB(a.h, b.h, r.h);
    r.l = DELAUNAY__MADD(a.h, b.l, r.l);
    r.l = DELAUNAY__MADD(a.l, b.h, r.l);
    return r;
}

DELAUNAY__TARGET DELAUNAY_INLINE delaunay__dd4 delaunay__dd_add(delaunay__dd4 a, delaunay__dd4 b)
{
    delaunay__dd4 r;
    __m256d t;
    r.h = _mm256_add_pd(a.h, b.h);
    t = _mm256_sub_pd(r.h, a.h);
    t = _mm256_add_pd(_mm256_sub_pd(a.h, _mm256_sub_pd(r.h, t)), _mm256_sub_pd(b.h, t));
    r.l = _mm256_add_pd(t, _mm256_add_pd(a.l, b.l));
    return r;
}

DELAUNAY__TARGET DELAUNAY_INLINE delaunay__dd4 delaunay__dd_sub(delaunay__dd4 a, delaunay__dd4 b)
{
    delaunay__dd4 r = delaunay__dd_difference(a.h, b.h);
    r.l = _mm256_add_pd(r.l, _mm256_sub_pd(a.l, b.l));
    return r;
}

DELAUNAY__TARGET DELAUNAY_INLINE delaunay__dd4 delaunay__dd_minor(const delaunay__dd4 *a,
                                                                  const delaunay__dd4 *b)
{
    return delaunay__dd_sub(delaunay__dd_mul(a[0], b[1]), delaunay__dd_mul(b[0], a[1]));
}

DELAUNAY__TARGET DELAUNAY_INLINE delaunay__dd4 delaunay__dd_lift(const delaunay__dd4 *a)
{
    return delaunay__dd_add(
        delaunay__dd_add(delaunay__dd_mul(a[0], a[0]), delaunay__dd_mul(a[1], a[1])),
        delaunay__dd_mul(a[2], a[2]));
}

/* The determinants of delaunay__in_conflict4_avx2 again, more precisely. Let l be at most c eps and
 * its error at most d eps^2, both times the permanent of what is computed. To first order (c, d) is
 * (1, 0) for differences, (4, 14) for minors, (8, 61) for their sums of three, (5, 26) for lifts
 * and (16, 219) for the determinant. Its permanent is below 5 R^5; 219 eps^2 times this is a
 * seventh of 1e-28 R^5. xyz[i][k]: coordinate k of vertex i of the four tetrahedra. */
static DELAUNAY__TARGET DELAUNAY__NOINLINE void
delaunay__insphere4_dd(__m256d xyz[4][3], const double *e, __m256d ghost, __m256d ghost_lift,
                       __m256d *det)
{
    delaunay__dd4 a[4][3], ab, bc, cd, da, ac, bd, abc, bcd, cda, dab, lift[4];
    int i, k;
    for (i = 0; i < 4; i++) {
        for (k = 0; k < 3; k++) {
            a[i][k] = delaunay__dd_difference(xyz[i][k], _mm256_set1_pd(e[k]));
            if (i < 3) continue;
            a[i][k].h = _mm256_andnot_pd(ghost, a[i][k].h);
            a[i][k].l = _mm256_andnot_pd(ghost, a[i][k].l);
        }
        lift[i] = delaunay__dd_lift(a[i]);
    }
    lift[3].h = _mm256_blendv_pd(lift[3].h, ghost_lift, ghost);
    ab = delaunay__dd_minor(a[0], a[1]);
    bc = delaunay__dd_minor(a[1], a[2]);
    cd = delaunay__dd_minor(a[2], a[3]);
    da = delaunay__dd_minor(a[3], a[0]);
    ac = delaunay__dd_minor(a[0], a[2]);
    bd = delaunay__dd_minor(a[1], a[3]);
    abc = delaunay__dd_add(
        delaunay__dd_sub(delaunay__dd_mul(a[0][2], bc), delaunay__dd_mul(a[1][2], ac)),
        delaunay__dd_mul(a[2][2], ab));
    bcd = delaunay__dd_add(
        delaunay__dd_sub(delaunay__dd_mul(a[1][2], cd), delaunay__dd_mul(a[2][2], bd)),
        delaunay__dd_mul(a[3][2], bc));
    cda = delaunay__dd_add(
        delaunay__dd_add(delaunay__dd_mul(a[2][2], da), delaunay__dd_mul(a[3][2], ac)),
        delaunay__dd_mul(a[0][2], cd));
    dab = delaunay__dd_add(
        delaunay__dd_add(delaunay__dd_mul(a[3][2], ab), delaunay__dd_mul(a[0][2], bd)),
        delaunay__dd_mul(a[1][2], da));
    abc = delaunay__dd_sub(delaunay__dd_mul(lift[2], dab), delaunay__dd_mul(lift[3], abc));
    bcd = delaunay__dd_sub(delaunay__dd_mul(lift[0], bcd), delaunay__dd_mul(lift[1], cda));
    abc = delaunay__dd_add(abc, bcd);
    *det = _mm256_add_pd(abc.h, abc.l);
}

/* The permanents of those determinants: the same sums, of the absolute values of all products. A
 * product goes through 16 roundings, so the error of delaunay__in_conflict4_avx2 is less than 17
 * eps times the permanent [Shewchuk 1997, 5.4]; 32 eps is safe although the permanent is rounded,
 * too. It is far below R^5 where points are nearly in line, or close to each other along an
 * axis. */
static DELAUNAY__TARGET DELAUNAY__NOINLINE __m256d
delaunay__insphere4_permanent(__m256d xyz[4][3], const double *e, __m256d ghost, __m256d ghost_lift)
{
    const __m256d sign = _mm256_set1_pd(-0.0);
    __m256d a[4][3], lift[4], ab, bc, cd, da, ac, bd, abc, bcd, cda, dab;
    int i, k;
    for (i = 0; i < 4; i++) {
        for (k = 0; k < 3; k++) {
            a[i][k] = _mm256_andnot_pd(sign, _mm256_sub_pd(xyz[i][k], _mm256_set1_pd(e[k])));
            if (i == 3) a[i][k] = _mm256_andnot_pd(ghost, a[i][k]);
        }
        lift[i] = DELAUNAY__MADD(a[i][0], a[i][0],
                                 DELAUNAY__MADD(a[i][1], a[i][1], _mm256_mul_pd(a[i][2], a[i][2])));
    }
    lift[3] = _mm256_blendv_pd(lift[3], ghost_lift, ghost);
    ab = DELAUNAY__MADD(a[0][0], a[1][1], _mm256_mul_pd(a[1][0], a[0][1]));
    bc = DELAUNAY__MADD(a[1][0], a[2][1], _mm256_mul_pd(a[2][0], a[1][1]));
    cd = DELAUNAY__MADD(a[2][0], a[3][1], _mm256_mul_pd(a[3][0], a[2][1]));
    da = DELAUNAY__MADD(a[3][0], a[0][1], _mm256_mul_pd(a[0][0], a[3][1]));
    ac = DELAUNAY__MADD(a[0][0], a[2][1], _mm256_mul_pd(a[2][0], a[0][1]));
    bd = DELAUNAY__MADD(a[1][0], a[3][1], _mm256_mul_pd(a[3][0], a[1][1]));
    abc = DELAUNAY__MADD(a[0][2], bc, DELAUNAY__MADD(a[1][2], ac, _mm256_mul_pd(a[2][2], ab)));
    bcd = DELAUNAY__MADD(a[1][2], cd, DELAUNAY__MADD(a[2][2], bd, _mm256_mul_pd(a[3][2], bc)));
    cda = DELAUNAY__MADD(a[2][2], da, DELAUNAY__MADD(a[3][2], ac, _mm256_mul_pd(a[0][2], cd)));
    dab = DELAUNAY__MADD(a[3][2], ab, DELAUNAY__MADD(a[0][2], bd, _mm256_mul_pd(a[1][2], da)));
    return DELAUNAY__MADD(lift[0], bcd,
                          DELAUNAY__MADD(lift[1], cda,
                                         DELAUNAY__MADD(lift[2], dab,
                                                        _mm256_mul_pd(lift[3], abc))));
}

/* delaunay__insphere_tie_doubles for four tetrahedra, from the ranks of their vertices and the
 * cofactors of these. Bit i: e is inside the sphere of tetrahedron i. */
DELAUNAY__TARGET DELAUNAY_INLINE unsigned delaunay__ties4(__m256d *rank, const __m256d *cofactor)
{
    const __m256d zero = _mm256_setzero_pd(), none = _mm256_set1_pd(-1);
    __m256d sign[2];
    int i, k;
    for (k = 0; k < 2; k++) {
        __m256d m = _mm256_max_pd(_mm256_max_pd(rank[0], rank[1]),
                                  _mm256_max_pd(rank[2], rank[3]));
        sign[k] = none;
        for (i = 0; i < 4; i++) {
            __m256d is = _mm256_cmp_pd(rank[i], m, _CMP_EQ_OQ);
            sign[k] = _mm256_blendv_pd(sign[k], cofactor[i], is);
            rank[i] = _mm256_blendv_pd(rank[i], none, is);
        }
        sign[k] = _mm256_blendv_pd(none, sign[k], _mm256_cmp_pd(m, zero, _CMP_GT_OQ));
    }
    sign[0] = _mm256_blendv_pd(sign[0], sign[1], _mm256_cmp_pd(sign[0], zero, _CMP_EQ_OQ));
    return delaunay__greater4(sign[0], zero);
}

/* The ranks of four vertices with these differences from e; see delaunay__insphere_tie_doubles. */
DELAUNAY__TARGET DELAUNAY_INLINE __m256d delaunay__ranks4(__m256d x, __m256d y, __m256d z)
{
    return DELAUNAY__MADD(x, _mm256_set1_pd(1048576),
                          DELAUNAY__MADD(y, _mm256_set1_pd(1024), z));
}

/* Tells more of the signs of det than the first error bound does: by that of the permanents and, if
 * need be, by determinants in double-doubles. Bit i of sure: the sign of lane i is certain; of *in:
 * it is plus. Returns which ones are sure then. */
DELAUNAY__TARGET DELAUNAY_INLINE unsigned
delaunay__insphere4_doubtful(__m256d xyz[4][3], const double *e, __m256d ghost, __m256d l,
                             __m256d det, unsigned sure, unsigned *in)
{
    const __m256d least = _mm256_set1_pd(delaunay__insphere_least2);
    const __m256d l4 = _mm256_mul_pd(_mm256_mul_pd(l, l), _mm256_mul_pd(l, l));
    __m256d error = delaunay__insphere4_permanent(xyz, e, ghost, l);
    error = _mm256_mul_pd(error, _mm256_set1_pd(16 * DBL_EPSILON));
    error = DELAUNAY__MADD(error, error, least);
    error = DELAUNAY__MADD(l4, least, error); /* underflow, times R^4 */
    sure |= delaunay__greater4(_mm256_mul_pd(det, det), error);
    if (sure == 15) return sure;
    delaunay__insphere4_dd(xyz, e, ghost, l, &det);
    *in = (*in & sure) | (delaunay__greater4(det, _mm256_setzero_pd()) & ~sure);
    error = DELAUNAY__MADD(_mm256_set1_pd(1e-56), _mm256_mul_pd(l4, l), least);
    return sure | delaunay__greater4(_mm256_mul_pd(det, det), error);
}

/* Replaces those of four results that are not sure by exact ones. */
DELAUNAY_INLINE unsigned delaunay__in_conflict4_exact(const delaunay__kernel *k,
                                                      const delaunay_handle *h, const double *e,
                                                      unsigned in, unsigned sure)
{
    unsigned i;
    for (i = 0; i < 4; i++) {
        if (sure >> i & 1) continue;
        in &= ~(1u << i);
        in |= (unsigned)delaunay__in_conflict_exact(k, h[i] >> 2, e) << i;
    }
    return in;
}

/* The vertices of four tetrahedra: xyz[i][k] is coordinate k of vertex i. Returns a mask of those
 * that have the ghost. */
DELAUNAY__TARGET DELAUNAY__ALWAYS_INLINE __m256d
delaunay__gather4(const delaunay__kernel *k, const delaunay_handle *h, __m256d xyz[4][3])
{
    const delaunay_vertex *x = k->vertices;
    const uint32_t *t0 = k->tets[h[0] >> 2].v, *t1 = k->tets[h[1] >> 2].v;
    const uint32_t *t2 = k->tets[h[2] >> 2].v, *t3 = k->tets[h[3] >> 2].v;
    DELAUNAY__TRANSPOSE(t0[0], t1[0], t2[0], t3[0], xyz[0][0], xyz[0][1], xyz[0][2]);
    DELAUNAY__TRANSPOSE(t0[1], t1[1], t2[1], t3[1], xyz[1][0], xyz[1][1], xyz[1][2]);
    DELAUNAY__TRANSPOSE(t0[2], t1[2], t2[2], t3[2], xyz[2][0], xyz[2][1], xyz[2][2]);
    DELAUNAY__TRANSPOSE(t0[3], t1[3], t2[3], t3[3], xyz[3][0], xyz[3][1], xyz[3][2]);
    return _mm256_castsi256_pd(_mm256_cvtepi32_epi64(_mm_cmpeq_epi32(
        _mm_setr_epi32((int)t0[3], (int)t1[3], (int)t2[3], (int)t3[3]), _mm_setzero_si128())));
}

/* Tests four tetrahedra, of which the last ones beyond count are padding. The ghost vertex becomes
 * the row (0, 0, 0, l) of the determinant, which is then l times the orientation of the hull facet.
 * l is the greatest lift of the other vertices, so that the error bound is that of a sphere. */
DELAUNAY__TARGET DELAUNAY__ALWAYS_INLINE unsigned
delaunay__in_conflict4_avx2(const delaunay__kernel *k, const delaunay_handle *h, unsigned count,
                            const double *e)
{
    const __m256d ex = _mm256_set1_pd(e[0]), ey = _mm256_set1_pd(e[1]), ez = _mm256_set1_pd(e[2]);
    const __m256d zero = _mm256_setzero_pd();
    const unsigned pad = 15u << count & 15;
    __m256d xyz[4][3], ghost, ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz;
    __m256d ab, bc, cd, da, ac, bd, abc, bcd, cda, dab, al, bl, cl, dl, l, l5, det;
    unsigned in, sure;
    ghost = delaunay__gather4(k, h, xyz);
    ax = _mm256_sub_pd(xyz[0][0], ex), ay = _mm256_sub_pd(xyz[0][1], ey),
    az = _mm256_sub_pd(xyz[0][2], ez);
    bx = _mm256_sub_pd(xyz[1][0], ex), by = _mm256_sub_pd(xyz[1][1], ey),
    bz = _mm256_sub_pd(xyz[1][2], ez);
    cx = _mm256_sub_pd(xyz[2][0], ex), cy = _mm256_sub_pd(xyz[2][1], ey),
    cz = _mm256_sub_pd(xyz[2][2], ez);
    dx = _mm256_andnot_pd(ghost, _mm256_sub_pd(xyz[3][0], ex));
    dy = _mm256_andnot_pd(ghost, _mm256_sub_pd(xyz[3][1], ey));
    dz = _mm256_andnot_pd(ghost, _mm256_sub_pd(xyz[3][2], ez));
    ab = DELAUNAY__MSUB(ax, by, _mm256_mul_pd(bx, ay)),
    bc = DELAUNAY__MSUB(bx, cy, _mm256_mul_pd(cx, by));
    cd = DELAUNAY__MSUB(cx, dy, _mm256_mul_pd(dx, cy)),
    da = DELAUNAY__MSUB(dx, ay, _mm256_mul_pd(ax, dy));
    ac = DELAUNAY__MSUB(ax, cy, _mm256_mul_pd(cx, ay)),
    bd = DELAUNAY__MSUB(bx, dy, _mm256_mul_pd(dx, by));
    abc = DELAUNAY__MADD(az, bc, DELAUNAY__NMADD(bz, ac, _mm256_mul_pd(cz, ab)));
    bcd = DELAUNAY__MADD(bz, cd, DELAUNAY__NMADD(cz, bd, _mm256_mul_pd(dz, bc)));
    cda = DELAUNAY__MADD(cz, da, DELAUNAY__MADD(dz, ac, _mm256_mul_pd(az, cd)));
    dab = DELAUNAY__MADD(dz, ab, DELAUNAY__MADD(az, bd, _mm256_mul_pd(bz, da)));
    al = DELAUNAY__MADD(ax, ax, DELAUNAY__MADD(ay, ay, _mm256_mul_pd(az, az)));
    bl = DELAUNAY__MADD(bx, bx, DELAUNAY__MADD(by, by, _mm256_mul_pd(bz, bz)));
    cl = DELAUNAY__MADD(cx, cx, DELAUNAY__MADD(cy, cy, _mm256_mul_pd(cz, cz)));
    dl = DELAUNAY__MADD(dx, dx, DELAUNAY__MADD(dy, dy, _mm256_mul_pd(dz, dz)));
    l = _mm256_max_pd(_mm256_max_pd(al, bl), _mm256_max_pd(cl, dl));
    dl = _mm256_blendv_pd(dl, l, ghost);
    det = _mm256_add_pd(DELAUNAY__MSUB(cl, dab, _mm256_mul_pd(dl, abc)),
                        DELAUNAY__MSUB(al, bcd, _mm256_mul_pd(bl, cda)));
    l5 = _mm256_mul_pd(l, l);
    l5 = _mm256_mul_pd(_mm256_mul_pd(l5, l5), l);
    in = delaunay__greater4(det, zero);
    sure = pad | delaunay__greater4(_mm256_mul_pd(det, det),
                                    DELAUNAY__MADD(_mm256_set1_pd(delaunay__insphere_error2), l5,
                                                   _mm256_set1_pd(delaunay__insphere_least2)));
    if (DELAUNAY__UNLIKELY(sure != 15)) {
        if (k->exact_doubles) {
            __m256d rank[4], cofactor[4];
            rank[0] = delaunay__ranks4(ax, ay, az), rank[1] = delaunay__ranks4(bx, by, bz);
            rank[2] = delaunay__ranks4(cx, cy, cz), rank[3] = delaunay__ranks4(dx, dy, dz);
            cofactor[0] = bcd, cofactor[1] = _mm256_sub_pd(zero, cda);
            cofactor[2] = dab, cofactor[3] = _mm256_sub_pd(zero, abc);
            sure |= (unsigned)_mm256_movemask_pd(_mm256_cmp_pd(det, zero, _CMP_NEQ_OQ));
            in = (in & sure) | (delaunay__ties4(rank, cofactor) & ~sure);
            sure |= ~(unsigned)_mm256_movemask_pd(ghost);
        } else sure = delaunay__insphere4_doubtful(xyz, e, ghost, l, det, sure, &in);
        in = delaunay__in_conflict4_exact(k, h, e, in, sure);
    }
    return in & ~pad;
}

/* The same for any number of tetrahedra; h is padded to a multiple of four. */
static DELAUNAY__TARGET unsigned delaunay__in_conflict_avx2(const delaunay__kernel *k,
                                                            const delaunay_handle *h,
                                                            unsigned count, const double *e)
{
    unsigned i, in = 0;
    for (i = 0; i < count; i += 4)
        in |= delaunay__in_conflict4_avx2(k, h + i, count - i < 4 ? count - i : 4, e) << i;
    return in;
}

/* Of four vertices, a lane each: their differences from e, and the squares of the lengths. */
typedef struct delaunay__four {
    __m256d x, y, z, l;
} delaunay__four;

DELAUNAY__TARGET DELAUNAY_INLINE delaunay__four
delaunay__four_of(const delaunay_vertex *x, const uint32_t *v, __m256d e)
{
    __m256d a = _mm256_sub_pd(e, _mm256_loadu_pd(x[v[0]].x));
    __m256d b = _mm256_sub_pd(e, _mm256_loadu_pd(x[v[1]].x));
    __m256d c = _mm256_sub_pd(e, _mm256_loadu_pd(x[v[2]].x));
    __m256d d = _mm256_sub_pd(e, _mm256_loadu_pd(x[v[3]].x));
    __m256d xz = _mm256_unpacklo_pd(a, b), y = _mm256_unpackhi_pd(a, b);
    delaunay__four r;
    a = _mm256_unpacklo_pd(c, d), b = _mm256_unpackhi_pd(c, d);
    r.x = _mm256_permute2f128_pd(xz, a, 0x20);
    r.y = _mm256_permute2f128_pd(y, b, 0x20);
    r.z = _mm256_permute2f128_pd(xz, a, 0x31);
    r.l = DELAUNAY__MADD(r.x, r.x, DELAUNAY__MADD(r.y, r.y, _mm256_mul_pd(r.z, r.z)));
    return r;
}

/* Makes a[1] to a[3] of a[0]: lane i of a[j] is lane i ^ j of a[0]. For every i, (i, i ^ 1, i ^ 2,
 * i ^ 3) is an even permutation. */
DELAUNAY__TARGET DELAUNAY_INLINE void delaunay__swap_lanes(__m256d *a)
{
    a[1] = _mm256_permute_pd(a[0], 5);
    a[2] = _mm256_permute2f128_pd(a[0], a[0], 1);
    a[3] = _mm256_permute_pd(a[2], 5);
}

/* The orientation determinants of e and a tetrahedron's facets: lane i is positive if e is beyond
 * facet i. */
DELAUNAY__TARGET DELAUNAY__ALWAYS_INLINE __m256d
delaunay__facet_dets(const delaunay__four *p)
{
    __m256d x[4], y[4], z[4], xy12, xy13, xy23;
    x[0] = p->x, y[0] = p->y, z[0] = p->z;
    delaunay__swap_lanes(x);
    delaunay__swap_lanes(y);
    delaunay__swap_lanes(z);
    xy12 = DELAUNAY__MSUB(x[1], y[2], _mm256_mul_pd(x[2], y[1]));
    xy23 = DELAUNAY__MSUB(x[2], y[3], _mm256_mul_pd(x[3], y[2]));
    xy13 = DELAUNAY__MSUB(x[1], y[3], _mm256_mul_pd(x[3], y[1]));
    return DELAUNAY__MADD(z[1], xy23, DELAUNAY__NMADD(z[2], xy13, _mm256_mul_pd(z[3], xy12)));
}

static DELAUNAY__TARGET delaunay_handle delaunay__walk_avx2(const delaunay__kernel *k,
                                                            delaunay_handle t, const double *e)
{
    const __m256d e4 = _mm256_setr_pd(e[0], e[1], e[2], 1);
    unsigned open = 15;
    int steps;
    for (steps = 0; steps < 1000; steps++) {
        const uint32_t *v = k->tets[t].v;
        delaunay__four p;
        delaunay_handle h;
        __m256d det;
        unsigned out;
        if (v[3] == DELAUNAY_GHOST) return t;
        p = delaunay__four_of(k->vertices, v, e4);
        det = delaunay__facet_dets(&p);
        out = delaunay__greater4(det, _mm256_setzero_pd()) & open;
        if (!out) return t;
        h = k->tets[t].n[__builtin_ctz(out)];
        if (k->parallel && delaunay__is_foreign(k, delaunay__apex(k, h))) return DELAUNAY_NONE;
        t = h >> 2;
        open = ~(1u << (h & 3));
    }
    return t;
}

#    if !defined(DELAUNAY_INDEX64)
#      define DELAUNAY__DIG
/* For each mask of lanes the order of bytes that brings these lanes to the front. */
#      define DELAUNAY__LANE(i) 4 * (i), 4 * (i) + 1, 4 * (i) + 2, 4 * (i) + 3
#      define DELAUNAY__LANES(a, b, c, d)                                                          \
        { DELAUNAY__LANE(a), DELAUNAY__LANE(b), DELAUNAY__LANE(c), DELAUNAY__LANE(d) }
static const uint8_t delaunay__lanes[16][16] = {
    DELAUNAY__LANES(0, 0, 0, 0), DELAUNAY__LANES(0, 0, 0, 0), DELAUNAY__LANES(1, 0, 0, 0),
    DELAUNAY__LANES(0, 1, 0, 0), DELAUNAY__LANES(2, 0, 0, 0), DELAUNAY__LANES(0, 2, 0, 0),
    DELAUNAY__LANES(1, 2, 0, 0), DELAUNAY__LANES(0, 1, 2, 0), DELAUNAY__LANES(3, 0, 0, 0),
    DELAUNAY__LANES(0, 3, 0, 0), DELAUNAY__LANES(1, 3, 0, 0), DELAUNAY__LANES(0, 1, 3, 0),
    DELAUNAY__LANES(2, 3, 0, 0), DELAUNAY__LANES(0, 2, 3, 0), DELAUNAY__LANES(1, 2, 3, 0),
    DELAUNAY__LANES(0, 1, 2, 3)};
#      undef DELAUNAY__LANES

/* Appends the chosen ones of four handles to a list with room for four; returns its new length. */
DELAUNAY__TARGET DELAUNAY_INLINE size_t delaunay__append_lanes(delaunay_handle *list, size_t num,
                                                               __m128i four, unsigned chosen)
{
    __m128i order = _mm_loadu_si128((const __m128i *)(const void *)delaunay__lanes[chosen]);
    _mm_storeu_si128((__m128i *)(void *)(list + num), _mm_shuffle_epi8(four, order));
    return num + (size_t)__builtin_popcount(chosen);
}

/* The in-sphere determinants of e for the neighbours of a tetrahedron. Lane i is that of the
 * neighbour behind facet i, negative if it is in conflict: delaunay__rows_det with the apex of the
 * neighbour instead of vertex i. The rows of lane i are i, i ^ 1, i ^ 2, i ^ 3, an even
 * permutation. The determinant is a sum of products of two minors, the first in x and y, the second
 * in z and lift. They go through 16 roundings as in delaunay__rows_det, so the error bound is the
 * same. */
DELAUNAY__TARGET DELAUNAY__ALWAYS_INLINE __m256d
delaunay__neighbor_dets(const delaunay__four *p, const delaunay__four *apex)
{
    __m256d x[4], y[4], z[4], l[4], xy01, xy02, xy03, xy12, xy13, xy23, zl, det, det2;
    x[0] = p->x, y[0] = p->y, z[0] = p->z, l[0] = p->l;
    delaunay__swap_lanes(x);
    delaunay__swap_lanes(y);
    x[0] = apex->x, y[0] = apex->y;
    xy12 = DELAUNAY__MSUB(x[1], y[2], _mm256_mul_pd(x[2], y[1]));
    xy23 = DELAUNAY__MSUB(x[2], y[3], _mm256_mul_pd(x[3], y[2]));
    xy13 = DELAUNAY__MSUB(x[1], y[3], _mm256_mul_pd(x[3], y[1]));
    xy01 = DELAUNAY__MSUB(x[0], y[1], _mm256_mul_pd(x[1], y[0]));
    xy02 = DELAUNAY__MSUB(x[0], y[2], _mm256_mul_pd(x[2], y[0]));
    xy03 = DELAUNAY__MSUB(x[0], y[3], _mm256_mul_pd(x[3], y[0]));
    delaunay__swap_lanes(z);
    delaunay__swap_lanes(l);
    z[0] = apex->z, l[0] = apex->l;
    zl = DELAUNAY__MSUB(z[2], l[3], _mm256_mul_pd(z[3], l[2]));
    det = _mm256_mul_pd(xy01, zl);
    zl = DELAUNAY__MSUB(z[0], l[1], _mm256_mul_pd(z[1], l[0]));
    det2 = _mm256_mul_pd(xy23, zl);
    zl = DELAUNAY__MSUB(z[1], l[3], _mm256_mul_pd(z[3], l[1]));
    det = DELAUNAY__NMADD(xy02, zl, det);
    zl = DELAUNAY__MSUB(z[0], l[2], _mm256_mul_pd(z[2], l[0]));
    det2 = DELAUNAY__NMADD(xy13, zl, det2);
    zl = DELAUNAY__MSUB(z[1], l[2], _mm256_mul_pd(z[2], l[1]));
    det = DELAUNAY__MADD(xy03, zl, det);
    zl = DELAUNAY__MSUB(z[0], l[3], _mm256_mul_pd(z[3], l[0]));
    det2 = DELAUNAY__MADD(xy12, zl, det2);
    return _mm256_add_pd(det, det2);
}

DELAUNAY_INLINE unsigned delaunay__exchange_mark(uint8_t *mark, delaunay_handle h, int value,
                                                 const int parallel)
{
    unsigned old = parallel ? DELAUNAY__LOAD(&mark[h >> 2]) : mark[h >> 2];
    if (parallel) DELAUNAY__STORE(&mark[h >> 2], (uint8_t)value);
    else mark[h >> 2] = (uint8_t)value;
    return old;
}

/* Marks four tetrahedra with the signs of four numbers, DELAUNAY__MARK_DUG for minus, 0 for plus.
 * Bit i: tetrahedron i was marked before. */
DELAUNAY__TARGET DELAUNAY_INLINE unsigned delaunay__exchange_marks(uint8_t *mark,
                                                                   const delaunay_handle *n,
                                                                   __m256d signs,
                                                                   const int parallel)
{
    const __m256i s = _mm256_castpd_si256(_mm256_and_pd(signs, _mm256_set1_pd(-0.0)));
    const __m128i lo = _mm256_castsi256_si128(s), hi = _mm256_extracti128_si256(s, 1);
    unsigned a = delaunay__exchange_mark(mark, n[0], _mm_extract_epi8(lo, 7), parallel);
    unsigned b = delaunay__exchange_mark(mark, n[1], _mm_extract_epi8(lo, 15), parallel);
    unsigned c = delaunay__exchange_mark(mark, n[2], _mm_extract_epi8(hi, 7), parallel);
    unsigned d = delaunay__exchange_mark(mark, n[3], _mm_extract_epi8(hi, 15), parallel);
    return (a + 2 * b + 4 * (c + 2 * d)) / DELAUNAY__MARK_DUG;
}

/* Whether the signs of all determinants are certain, by the least of them in absolute value and the
 * greatest lifts. They are not if something overflowed: then the bound is infinite. */
DELAUNAY__TARGET DELAUNAY_INLINE int delaunay__are_sure(__m256d least, __m256d most)
{
    double det[4], lift[4], d;
    _mm256_storeu_pd(det, least);
    _mm256_storeu_pd(lift, most);
    d = det[0] < det[1] ? det[0] : det[1];
    d = d < det[2] ? d : det[2];
    d = d < det[3] ? d : det[3];
    return d * d > delaunay__insphere_bound2(lift);
}

enum { DELAUNAY__BY_CLAIMS = 2 }; /* parallel below; 0: not, 1: in a section */

/* Digging: a fast search for the cavity of e in simple cases, with no ghost near, no sign in doubt,
 * and not many tetrahedra. All four neighbours of a tetrahedron of the cavity are tested at once,
 * including those that were seen before: this costs less than finding out which were not, and gives
 * the same answers. Those in conflict and not marked yet are appended to the cavity, those not in
 * conflict to the border, so that the only data-dependent branch is that of the loop. Whether all
 * signs were certain is tested at the end: wrong ones can lead to tetrahedra of the section only,
 * and not to many. On success the cavity is marked and nothing else; with DELAUNAY__NOT_SURE or
 * DELAUNAY__FOREIGN nothing is. */
DELAUNAY__TARGET DELAUNAY__ALWAYS_INLINE int
delaunay__dig_in(delaunay__kernel *k, delaunay_handle seed, const double *e, const int parallel)
{
    const delaunay_vertex *x = k->vertices;
    const uint32_t *words = k->tets[0].v; /* a tetrahedron has eight words: that of handle h begins
                                           * at 2 (h - h mod 4), its apex is h mod 4 further */
    const uint32_t start = k->start, length = k->length;
    delaunay__claims *claims = k->claims;
    const __m256d e4 = _mm256_setr_pd(e[0], e[1], e[2], 1);
    const delaunay__four first = delaunay__four_of(x, k->tets[seed].v, e4);
    __m256d least = delaunay__neighbor_dets(&first, &first), most = first.l; /* the seed's own */
    delaunay_handle *cavity = k->cavity, *border = k->border;
    uint8_t *mark = k->mark;
    size_t num_cavity = 1, num_border = 0, done;
    int result = DELAUNAY__NOT_SURE, i;
    /* the seed's own rows are oriented the other way than those of its neighbours: positive */
    if (_mm256_movemask_pd(least)) return result;
    cavity[0] = 4 * seed;
    DELAUNAY__STORE(&mark[seed], DELAUNAY__MARK_DUG);
    for (done = 0; done < num_cavity; done++) {
        const uint32_t *v = words + 2 * (size_t)(cavity[done] & ~3u), *n = v + 4;
        const __m128i n4 = _mm_loadu_si128((const __m128i *)(const void *)n);
        delaunay__four p, d;
        unsigned in, seen;
        uint32_t apex[4];
        __m256d det;
        for (i = 0; i < 4; i++) apex[i] = words[(size_t)n[i] + (n[i] & ~3u)];
        for (i = 0; i < 4; i++)
            if (DELAUNAY__UNLIKELY(apex[i] == DELAUNAY_GHOST)) goto undo;
        for (i = 0; i < 4 && parallel; i++)
            if (DELAUNAY__UNLIKELY(parallel == DELAUNAY__BY_CLAIMS
                                       ? !delaunay__claim_cell(claims, x[apex[i]].key)
                                       : (uint32_t)(x[apex[i]].key - start) >= length)) {
                result = DELAUNAY__FOREIGN;
                goto undo;
            }
        p = delaunay__four_of(x, v, e4);
        d = delaunay__four_of(x, apex, e4);
        det = delaunay__neighbor_dets(&p, &d);
        least = _mm256_min_pd(least, _mm256_andnot_pd(_mm256_set1_pd(-0.0), det));
        most = _mm256_max_pd(most, d.l);
        in = (unsigned)_mm256_movemask_pd(det);
        seen = delaunay__exchange_marks(mark, n, det, parallel);
        num_border = delaunay__append_lanes(border, num_border, n4, in ^ 15);
        num_cavity = delaunay__append_lanes(cavity, num_cavity, n4, in & ~seen);
        if (DELAUNAY__UNLIKELY(num_cavity > DELAUNAY__MATRIX_CAVITY)) goto undo;
    }
    if (!delaunay__are_sure(least, most)) goto undo;
    k->num_cavity = num_cavity;
    k->num_border = num_border;
    return DELAUNAY_OK;
undo:
    while (num_cavity) DELAUNAY__STORE(&mark[cavity[--num_cavity] >> 2], 0);
    return result;
}

static DELAUNAY__TARGET int delaunay__dig(delaunay__kernel *k, delaunay_handle seed,
                                          const double *e)
{
    if (k->tets[seed].v[3] == DELAUNAY_GHOST) return DELAUNAY__NOT_SURE;
    if (!k->parallel) return delaunay__dig_in(k, seed, e, 0);
    return k->claims ? delaunay__dig_in(k, seed, e, DELAUNAY__BY_CLAIMS)
                     : delaunay__dig_in(k, seed, e, 1);
}

/* Whether e is certainly on the inner side of all facets, by their greatest determinants and the
 * greatest lifts; the error bound is that of delaunay_orient3d. */
DELAUNAY__TARGET DELAUNAY_INLINE int delaunay__sees_for_sure(__m256d greatest, __m256d most)
{
    double det[4], lift[4], d, l;
    _mm256_storeu_pd(det, greatest);
    _mm256_storeu_pd(lift, most);
    d = det[0] > det[1] ? det[0] : det[1];
    d = d > det[2] ? d : det[2];
    d = d > det[3] ? d : det[3];
    l = lift[0] > lift[1] ? lift[0] : lift[1];
    l = l > lift[2] ? l : lift[2];
    l = l > lift[3] ? l : lift[3];
    return d < 0 && d * d > 2e-30 * (l * l * l) + 1e-270;
}

/* Shuts the constrained facets of a tetrahedron: in n, the handles of its neighbours, theirs become
 * 0; in apex, the vertices behind the facets, theirs become the tetrahedron's own opposite
 * vertices. Returns four numbers, negative (by their sign bits) for the constrained facets. */
DELAUNAY__TARGET DELAUNAY_INLINE __m256d delaunay__shut_facets(const uint32_t *v, unsigned flags,
                                                               uint32_t *n, uint32_t *apex)
{
    uint64_t shut[4];
    int i;
    for (i = 0; i < 4; i++) {
        shut[i] = flags & DELAUNAY_FACET_BIT(i) ? UINT64_C(1) << 63 : 0;
        if (!shut[i]) continue;
        n[i] = 0;
        apex[i] = v[i];
    }
    return _mm256_castsi256_pd(_mm256_loadu_si256((const __m256i *)(const void *)shut));
}

/* Prefetches the neighbours of the tetrahedron of handle h; words: see delaunay__dig_in. */
DELAUNAY_INLINE void delaunay__fetch_neighbors(const uint32_t *words, delaunay_handle h)
{
    const uint32_t *n = words + 2 * (size_t)(h & ~3u) + 4;
    int i;
    for (i = 0; i < 4; i++) DELAUNAY__PREFETCH(words + 2 * (size_t)(n[i] & ~3u));
}

/* As delaunay__dig_in, but only the tetrahedra of the cavity must be in the section, not those
 * around it, and e must see the facets of the border: the determinants of a neighbour and of a
 * facet have minors in common. Constrained facets are part of the border, whatever is behind them;
 * slot 0, which no section has, is marked instead of what is there. */
static DELAUNAY__TARGET delaunay_plainness delaunay__dig_plain(delaunay_plain *plain,
                                                               delaunay_mesh *mesh,
                                                               const double *e,
                                                               delaunay_handle seed,
                                                               const uint32_t *section)
{
    const delaunay_vertex *x = mesh->vertices;
    const uint32_t *words = mesh->tets[0].v; /* see delaunay__dig_in */
    const __m256d e4 = _mm256_setr_pd(e[0], e[1], e[2], 1), none = _mm256_set1_pd(-DBL_MAX);
    const __m128i facets = _mm_setr_epi32(0, 1, 2, 3);
    const delaunay__four first = delaunay__four_of(x, mesh->tets[seed].v, e4);
    __m256d least = delaunay__neighbor_dets(&first, &first), most = first.l, greatest = none;
    delaunay_handle *cavity = plain->tets, *border = plain->border;
    uint8_t *mark = mesh->mark;
    size_t num_cavity = 1, num_border = 0, done;
    delaunay_plainness result = DELAUNAY_NOT_PLAIN;
    unsigned all_flags = 0;
    int i;
    if (_mm256_movemask_pd(least)) return result;
    cavity[0] = 4 * seed;
    DELAUNAY__STORE(&mark[seed], DELAUNAY__MARK_DUG);
    for (done = 0; done < num_cavity; done++) {
        const delaunay_handle own = cavity[done] & ~3u;
        const uint32_t *v = words + 2 * (size_t)own;
        const __m128i own4 = _mm_add_epi32(_mm_set1_epi32((int)own), facets);
        const unsigned flags = mesh->flags[own >> 2];
        __m256d shut = _mm256_setzero_pd(), det, behind;
        delaunay__four p, d;
        unsigned in, seen, foreign = 0;
        uint32_t n[4], apex[4];
        if (done + 2 < num_cavity) delaunay__fetch_neighbors(words, cavity[done + 2]);
        all_flags |= flags;
        memcpy(n, v + 4, sizeof n);
        for (i = 0; i < 4; i++) apex[i] = words[(size_t)n[i] + (n[i] & ~3u)];
        if (DELAUNAY__UNLIKELY(flags & DELAUNAY_FACET_BITS))
            shut = delaunay__shut_facets(v, flags, n, apex);
        for (i = 0; i < 4; i++)
            if (DELAUNAY__UNLIKELY(apex[i] == DELAUNAY_GHOST)) goto undo;
        for (i = 0; i < 4 && section; i++) foreign |= (unsigned)(x[apex[i]].key != *section) << i;
        p = delaunay__four_of(x, v, e4);
        d = delaunay__four_of(x, apex, e4);
        det = delaunay__neighbor_dets(&p, &d);
        det = _mm256_blendv_pd(det, _mm256_set1_pd(DBL_MAX), shut);
        behind = _mm256_blendv_pd(delaunay__facet_dets(&p), none, det); /* of border facets only */
        greatest = _mm256_max_pd(greatest, behind);
        least = _mm256_min_pd(least, _mm256_andnot_pd(_mm256_set1_pd(-0.0), det));
        most = _mm256_max_pd(most, d.l);
        in = (unsigned)_mm256_movemask_pd(det);
        if (in & foreign) {
            if (delaunay__are_sure(least, most)) result = DELAUNAY_PLAIN_ELSEWHERE;
            goto undo;
        }
        seen = delaunay__exchange_marks(mark, n, det, 1);
        num_border = delaunay__append_lanes(border, num_border, own4, in ^ 15);
        num_cavity = delaunay__append_lanes(
            cavity, num_cavity, _mm_loadu_si128((const __m128i *)(const void *)n), in & ~seen);
        if (DELAUNAY__UNLIKELY(num_cavity > DELAUNAY_PLAIN_MOST)) goto undo;
    }
    if (delaunay__are_sure(least, most) && delaunay__sees_for_sure(greatest, most))
        result = DELAUNAY_PLAIN;
    plain->num_tets = (uint32_t)num_cavity;
    plain->num_border = (uint32_t)num_border;
    plain->flags = all_flags;
undo:
    while (num_cavity) DELAUNAY__STORE(&mark[cavity[--num_cavity] >> 2], 0);
    return result;
}
#    endif
#    undef DELAUNAY__TRANSPOSE
#    undef DELAUNAY__MADD
#    undef DELAUNAY__MSUB
#    undef DELAUNAY__NMADD
#  endif

static DELAUNAY__NOINLINE unsigned delaunay__in_conflict4_weighted(const delaunay__kernel *k,
                                                                   const delaunay_handle *h,
                                                                   unsigned count, const double *e)
{
    /* e points into the array of vertices */
    uint32_t q = (uint32_t)((const delaunay_vertex *)(const void *)e - k->vertices);
    unsigned i, in = 0;
    for (i = 0; i < count; i++)
        in |= (unsigned)delaunay__in_conflict_weighted(k, h[i] >> 2, q) << i;
    return in;
}

static unsigned delaunay__in_conflict_few(const delaunay__kernel *k, const delaunay_handle *h,
                                          unsigned count, const double *e)
{
    if (DELAUNAY__UNLIKELY(k->weight != NULL))
        return delaunay__in_conflict4_weighted(k, h, count, e);
#  if defined(DELAUNAY__AVX2)
    if (k->simd) return delaunay__in_conflict_avx2(k, h, count, e);
#  endif
    return delaunay__in_conflict_plain(k, h, count, e);
}

static delaunay_handle delaunay__walk_fast(const delaunay__kernel *k, delaunay_handle t,
                                           const double *e)
{
#  if defined(DELAUNAY__AVX2)
    if (k->simd) return delaunay__walk_avx2(k, t, e);
#  endif
    return delaunay__walk(k, t, e);
}

/* How far the search for a cavity has come. The lists, which are the kernel's, hold handles 4*t+f,
 * where f is the facet through which the search reached tetrahedron t. */
typedef struct delaunay__cavity_search {
    delaunay_handle *queue;  /* candidates: tetrahedra seen so far */
    delaunay_handle *cavity; /* those of them in conflict */
    delaunay_handle *border; /* those not in conflict: their facet f is on the cavity's boundary */
    delaunay_handle *again;  /* facets that lead to a tetrahedron seen before */
    size_t num_queue, num_cavity, num_border, num_again;
    size_t done;     /* of the queue have been tested */
    size_t expanded; /* of the cavity have their neighbours in the queue */
} delaunay__cavity_search;

/* Takes the lists from the kernel. */
DELAUNAY_INLINE void delaunay__cavity_lists(delaunay__cavity_search *s, const delaunay__kernel *k)
{
    s->queue = k->queue;
    s->cavity = k->cavity;
    s->border = k->border;
    s->again = k->again;
}

static void delaunay__cavity_undo(delaunay__kernel *k, size_t num_queue, size_t num_again)
{
    size_t i;
    for (i = 0; i < num_queue; i++) DELAUNAY__STORE(&k->mark[k->queue[i] >> 2], 0);
    for (i = 0; i < num_again; i++) DELAUNAY__STORE(&k->mark[k->again[i] >> 2], 0);
}

/* How many of the candidates to test before their neighbours are added: multiples of four where
 * possible, whose tests overlap, as they do not depend on each other. The order of the search does
 * not depend on this number. */
static unsigned delaunay__batch(size_t candidates)
{
    return candidates < 4 ? (unsigned)candidates : candidates < 8 ? 4 : candidates < 12 ? 8 : 12;
}

/* Puts the seed and its neighbours into the queue. */
DELAUNAY_INLINE void delaunay__cavity_start(const delaunay__kernel *k, delaunay__cavity_search *s,
                                            delaunay_handle seed)
{
    unsigned i;
    delaunay__cavity_lists(s, k);
    s->queue[0] = 4 * seed;
    DELAUNAY__STORE(&k->mark[seed], DELAUNAY__MARK_CAVITY);
    for (i = 0; i < 4; i++) {
        s->queue[i + 1] = k->tets[seed].n[i];
        DELAUNAY__STORE(&k->mark[s->queue[i + 1] >> 2], DELAUNAY__MARK_SEEN);
    }
    s->num_queue = 5;
    s->num_cavity = s->num_border = s->num_again = s->done = 0;
    s->expanded = 1; /* the seed, once it is in the cavity */
}

/* Whether the apex of one of these tetrahedra is not in the section. */
DELAUNAY_INLINE int delaunay__any_foreign(const delaunay__kernel *k, const delaunay_handle *h,
                                          size_t count)
{
    size_t i;
    for (i = 0; i < count; i++)
        if (delaunay__is_foreign(k, delaunay__apex(k, h[i]))) return 1;
    return 0;
}

/* Splits the next candidates without branches into cavity and border; bit i of `in`: candidate i is
 * in conflict. */
DELAUNAY_INLINE void delaunay__cavity_split(delaunay__cavity_search *s, unsigned count,
                                            unsigned in)
{
    unsigned i;
    for (i = 0; i < count; i++) {
        s->cavity[s->num_cavity] = s->border[s->num_border] = s->queue[s->done + i];
        s->num_cavity += in >> i & 1;
        s->num_border += ~in >> i & 1;
    }
    s->done += count;
}

/* Puts the neighbours of what is new in the cavity into the queue, those seen before into again. */
DELAUNAY_INLINE void delaunay__cavity_expand(const delaunay__kernel *k, delaunay__cavity_search *s)
{
    const delaunay_tet *tets = k->tets;
    uint8_t *mark = k->mark;
    unsigned i;
    while (s->expanded < s->num_cavity) {
        delaunay_handle h = s->cavity[s->expanded++];
        const delaunay_handle *n = tets[h >> 2].n;
        DELAUNAY__STORE(&mark[h >> 2], DELAUNAY__MARK_CAVITY);
        for (i = 1; i < 4; i++) {
            delaunay_handle b = n[(h & 3) ^ i];
            uint8_t seen = DELAUNAY__LOAD(&mark[b >> 2]);
            s->queue[s->num_queue] = s->again[s->num_again] = b;
            s->num_queue += !seen;
            s->num_again += !!seen;
            DELAUNAY__STORE(&mark[b >> 2], (uint8_t)(seen | DELAUNAY__MARK_SEEN));
            DELAUNAY__PREFETCH(&tets[b >> 2]);
        }
    }
}

/* Adds to the border the facets that lead to a tetrahedron seen before, unless that turned out to
 * be in the cavity. */
DELAUNAY_INLINE void delaunay__cavity_close(const delaunay__kernel *k, delaunay__cavity_search *s)
{
    size_t i;
    for (i = 0; i < s->num_again; i++) {
        s->border[s->num_border] = s->again[i];
        s->num_border += DELAUNAY__LOAD(&k->mark[s->again[i] >> 2]) == DELAUNAY__MARK_SEEN;
    }
}

/* Makes room in the lists for one more batch. In a parallel region this has to wait. */
DELAUNAY_INLINE int delaunay__cavity_room(delaunay__kernel *k, delaunay__cavity_search *s)
{
    int result = DELAUNAY_OK;
    if (DELAUNAY__UNLIKELY(s->num_queue + s->num_again + DELAUNAY__SEARCH_SLACK > k->cap_search)) {
        result = k->parallel ? (int)DELAUNAY__NEEDS_MEMORY : (int)delaunay__kernel_grow_search(k);
        if (result != DELAUNAY_OK) k->needs_memory = 1;
        delaunay__cavity_lists(s, k);
    }
    return result;
}

/* Breadth-first search for the cavity [Marot 2020, 3.5]. Candidates are tested in fours and split
 * into cavity and border. Facets that lead to a tetrahedron seen before go to again; if it is not
 * in the cavity, they are on the boundary, too. The ball clears the marks.
 * In a parallel region all tetrahedra of the cavity and around it must be in the section. A
 * neighbour of one that is has three vertices in it, so only its apex is tested. If this is foreign
 * the tetrahedron is in no section: several threads may set its mark, which then means nothing, so
 * those in again are tested, too. Nobody writes anything else of such a tetrahedron. */
static int delaunay__search_cavity(delaunay__kernel *k, delaunay_handle seed, const double *e)
{
    delaunay__cavity_search s;
    int result;
    delaunay__cavity_start(k, &s, seed);
    do {
        const unsigned first = s.done == 0; /* the seed is in the section */
        unsigned count = delaunay__batch(s.num_queue - s.done), in, i;
        for (i = 0; i < 3; i++) s.queue[s.num_queue + i] = 0; /* pads the batch with the dummy */
        result = DELAUNAY__FOREIGN;
        if (k->parallel && delaunay__any_foreign(k, s.queue + s.done + first, count - first))
            goto undo;
        in = delaunay__in_conflict_few(k, s.queue + s.done, count, e);
        result = DELAUNAY__NOT_HERE;
        if (DELAUNAY__UNLIKELY(first && !(in & 1))) goto undo;
        delaunay__cavity_split(&s, count, in);
        delaunay__cavity_expand(k, &s);
        result = delaunay__cavity_room(k, &s);
        if (DELAUNAY__UNLIKELY(result != DELAUNAY_OK)) goto undo;
    } while (s.done < s.num_queue);
    result = DELAUNAY__FOREIGN;
    if (k->parallel && delaunay__any_foreign(k, s.again, s.num_again)) goto undo;
    delaunay__cavity_close(k, &s);
    k->num_cavity = s.num_cavity;
    k->num_border = s.num_border;
    return DELAUNAY_OK;
undo:
    delaunay__cavity_undo(k, s.num_queue, s.num_again);
    return result;
}

/* Finds the cavity of e, from a seed in it on, and the facets that bound it. Where digging has
 * failed (on hulls, on grids) it is not tried for a while. */
static int delaunay__cavity(delaunay__kernel *k, delaunay_handle seed, const double *e)
{
#  if defined(DELAUNAY__DIG)
    enum { DELAUNAY__WORTH = 64, DELAUNAY__IN_VAIN = 8 };
    if (k->simd && !k->weight) {
        if (k->doubts < DELAUNAY__WORTH) {
            int result = delaunay__dig(k, seed, e);
            k->doubts += result == DELAUNAY__NOT_SURE ? DELAUNAY__IN_VAIN : -(k->doubts > 0);
            k->dug = 1;
            if (result != DELAUNAY__NOT_SURE) return result;
        } else k->doubts--;
    }
#  endif
    k->dug = 0;
    return delaunay__search_cavity(k, seed, e);
}

/* Writes the new tetrahedron of p and the boundary facet h (seen from outside) to slot s, the ghost
 * last, and links it to the outside. v: gets its vertices except for p. */
DELAUNAY_INLINE void delaunay__ball_tet(const delaunay__kernel *k, delaunay_handle h,
                                        delaunay_handle s, uint32_t p, uint32_t *v)
{
    delaunay_tet *o = &k->tets[h >> 2], *w = &k->tets[s];
    const uint8_t *f = delaunay_facet_vertices[h & 3];
    uint32_t a = o->v[f[0]], b = o->v[f[2]], c = o->v[f[1]], r;
    if (DELAUNAY__UNLIKELY(a == 0)) r = a, a = b, b = c, c = r;
    else if (DELAUNAY__UNLIKELY(b == 0)) r = b, b = a, a = c, c = r;
    w->v[0] = p;
    w->v[1] = v[0] = a;
    w->v[2] = v[1] = b;
    w->v[3] = v[2] = c;
    w->n[0] = h;
    o->n[h & 3] = 4 * s;
    DELAUNAY__STORE(&k->mark[h >> 2], 0);
}

/* Adjacencies inside the ball come from a matrix of 2^bits x 2^bits directed edges [Marot 2020,
 * 3.6]. The number of a vertex is that of a tetrahedron of the cavity which brought it: each brings
 * at most one, its apex opposite the facet through which the search came; the last number written
 * counts. The ghost always has number 0. Enters the edges of facet 0 of tetrahedron s; key: where
 * in the matrix the facets on the other sides of these edges are found. */
DELAUNAY_INLINE void delaunay__ball_enter(delaunay_handle *edges, uint16_t *key,
                                          const delaunay_vertex *vertices, delaunay_handle s,
                                          const uint32_t *v, const int bits)
{
    uint32_t x = vertices[v[0]].local, y = vertices[v[1]].local, z = vertices[v[2]].local;
    edges[y << bits | z] = 4 * s + 1;
    edges[z << bits | x] = 4 * s + 2;
    edges[x << bits | y] = 4 * s + 3;
    key[1] = (uint16_t)(z << bits | y);
    key[2] = (uint16_t)(x << bits | z);
    key[3] = (uint16_t)(y << bits | x);
}

DELAUNAY_INLINE void delaunay__ball_link(const delaunay__kernel *k, const delaunay_handle *slot)
{
    size_t j, count = k->num_border;
    const delaunay_handle *edges = k->edges;
    for (j = 0; j < count; j++) {
        delaunay_handle *n = k->tets[*(slot - j)].n;
        const uint16_t *key = k->edge_keys[j];
        n[1] = edges[key[1]];
        n[2] = edges[key[2]];
        n[3] = edges[key[3]];
    }
}

DELAUNAY_INLINE void delaunay__ball_small(const delaunay__kernel *k, const delaunay_handle *slot,
                                          uint32_t p, const int bits)
{
    size_t j, count = k->num_border;
    const delaunay_vertex *vertices = k->vertices;
    const delaunay_handle *border = k->border;
    delaunay_handle *edges = k->edges;
    uint16_t(*keys)[4] = k->edge_keys;
    for (j = 0; j < count; j++) {
        delaunay_handle s = *(slot - j);
        uint32_t v[3];
        delaunay__ball_tet(k, border[j], s, p, v);
        delaunay__ball_enter(edges, keys[j], vertices, s, v, bits);
    }
    delaunay__ball_link(k, slot);
}

/* Turns around the edge of the cavity's facet h that does not contain vertex third, through the
 * cavity until it leaves it. Returns the facet, of the new tetrahedron there, that is shared with
 * the new tetrahedron of h. */
DELAUNAY_INLINE delaunay_handle delaunay__ball_turn(const delaunay__kernel *k, delaunay_handle h,
                                                    uint32_t third)
{
    const delaunay_tet *tets = k->tets;
    delaunay_handle out;
    do {
        const delaunay_tet *t = &tets[h >> 2];
        uint32_t apex = t->v[h & 3];
        h = t->n[delaunay_local_index(t, third)];
        third = apex;
    } while (DELAUNAY__LOAD(&k->mark[h >> 2]) == DELAUNAY__MARK_CAVITY);
    out = tets[h >> 2].n[h & 3];
    return out + (delaunay_handle)delaunay_local_index(&tets[out >> 2], third);
}

/* Writes a ball that is too big for the matrix: adjacencies are found by turning around the edges
 * of the cavity's boundary, while the cavity still exists. Replaces the handles in border by those
 * of the same facets on the cavity's side. */
static void delaunay__ball_big(delaunay__kernel *k, const delaunay_handle *slot, uint32_t p)
{
    size_t j, count = k->num_border;
    int i;
    for (j = 0; j < count; j++) {
        delaunay_handle h = k->border[j], s = *(slot - j), *n = k->tets[s].n;
        uint32_t v[3];
        k->border[j] = k->tets[h >> 2].n[h & 3];
        delaunay__ball_tet(k, h, s, p, v);
        n[1] = n[2] = n[3] = DELAUNAY_NONE;
    }
    for (j = 0; j < count; j++) {
        delaunay_handle s = *(slot - j);
        delaunay_tet *t = &k->tets[s];
        for (i = 1; i < 4; i++) {
            delaunay_handle g;
            if (t->n[i] != DELAUNAY_NONE) continue;
            g = delaunay__ball_turn(k, k->border[j], t->v[i]);
            t->n[i] = g;
            k->tets[g >> 2].n[g & 3] = 4 * s + (delaunay_handle)i;
        }
    }
}

enum {
    DELAUNAY__SLOTS_AT_ONCE = 256,
    DELAUNAY__MANY_SLOTS = 1 << 25 /* 1 GiB of tetrahedra */
};

/* Draws some slots from the end of the array; several threads may do so at the same time. */
static delaunay_result delaunay__draw_slots(delaunay__kernel *k, size_t need)
{
    delaunay_mesh *mesh = k->mesh;
    delaunay_result result;
    if (k->parallel) {
        if (DELAUNAY__LOAD(&mesh->num_tets) + need + k->reserve > mesh->cap_tets) {
            k->needs_slots = k->needs_memory = 1;
            return DELAUNAY_ERROR_OUT_OF_MEMORY;
        }
#  if DELAUNAY__PARALLEL
        k->fresh = DELAUNAY__FETCH_ADD(&mesh->num_tets, DELAUNAY__SLOTS_AT_ONCE);
#  else
        k->fresh = mesh->num_tets; /* one section at a time */
        mesh->num_tets += DELAUNAY__SLOTS_AT_ONCE;
#  endif
    } else {
        if ((size_t)mesh->cap_tets - mesh->num_tets < DELAUNAY__SLOTS_AT_ONCE) {
            size_t cap = mesh->cap_tets; /* what is never touched costs address space only */
            int careful = cap > DELAUNAY__MANY_SLOTS || mesh->memory.limit_bytes != 0;
            result = delaunay__grow_tets(mesh, mesh->num_tets + DELAUNAY__SLOTS_AT_ONCE,
                                         (careful ? cap + cap / 2 : 3 * cap) + need + 1024);
            if (result != DELAUNAY_OK) return result;
            delaunay__kernel_view(k);
        }
        k->fresh = mesh->num_tets;
        mesh->num_tets += DELAUNAY__SLOTS_AT_ONCE;
    }
    k->fresh_end = k->fresh + DELAUNAY__SLOTS_AT_ONCE;
    return DELAUNAY_OK;
}

/* Adds at most so many of the slots dealt or drawn to the freed ones; the lowest is used next. */
static void delaunay__free_fresh(delaunay__kernel *k, size_t most)
{
    size_t count = k->fresh_end - k->fresh, i;
    if (count > most) count = most;
    for (i = count; i-- > 0;) {
        k->tets[k->fresh + i].v[0] = 0;
        k->freed[k->num_freed++] = k->fresh + (delaunay_handle)i;
    }
    k->fresh += (delaunay_handle)count;
}

/* Provides slots for a ball: freed ones, then those dealt, then some from the end of the array. */
static delaunay_result delaunay__ball_slots(delaunay__kernel *k, size_t need)
{
    delaunay_mesh *mesh = k->mesh;
    while (!k->parallel && k->num_freed < need && mesh->num_free)
        k->freed[k->num_freed++] = mesh->free_tets[--mesh->num_free];
    while (k->num_freed < need) {
        if (k->fresh == k->fresh_end) {
            delaunay_result result = delaunay__draw_slots(k, need);
            if (result != DELAUNAY_OK) return result;
        }
        delaunay__free_fresh(k, DELAUNAY__SLOTS_AT_ONCE);
    }
    return DELAUNAY_OK;
}

/* Makes room for what the next ball writes; on failure only capacities have changed. */
static int delaunay__ball_reserve(delaunay__kernel *k)
{
    size_t need = k->num_border;
    size_t freed = k->num_freed + k->num_cavity + need + DELAUNAY__SLOTS_AT_ONCE;
    delaunay_result result;
    if (k->parallel) {
        if (freed <= k->cap_freed && delaunay__ball_slots(k, need) == DELAUNAY_OK)
            return DELAUNAY_OK;
        k->needs_memory = 1;
        return DELAUNAY__NEEDS_MEMORY;
    }
    result = delaunay__kernel_reserve_freed(k, freed);
    return result != DELAUNAY_OK ? (int)result : (int)delaunay__ball_slots(k, need);
}

/* -- the same for a cavity that was dug: it has no ghosts, and nothing else is marked */
#  if defined(DELAUNAY__DIG)
/* For each facet the order of bytes that brings its vertices, as seen from behind, to lanes 1-3. */
#    define DELAUNAY__BEHIND(a, b, c)                                                              \
      { 128, 128, 128, 128, DELAUNAY__LANE(a), DELAUNAY__LANE(b), DELAUNAY__LANE(c) }
static const uint8_t delaunay__behind[4][16] = {
    DELAUNAY__BEHIND(1, 3, 2), DELAUNAY__BEHIND(0, 2, 3), DELAUNAY__BEHIND(0, 3, 1),
    DELAUNAY__BEHIND(0, 1, 2)};
#    undef DELAUNAY__BEHIND
#    undef DELAUNAY__LANE

DELAUNAY__TARGET DELAUNAY_INLINE void delaunay__ball_dug_in(const delaunay__kernel *k,
                                                            const delaunay_handle *slot,
                                                            uint32_t p, const int bits)
{
    const __m128i p4 = _mm_cvtsi32_si128((int)p);
    const delaunay_vertex *vertices = k->vertices;
    const delaunay_handle *border = k->border;
    delaunay_tet *tets = k->tets;
    uint32_t *words = tets[0].v; /* see delaunay__dig_in */
    delaunay_handle *edges = k->edges;
    uint16_t(*keys)[4] = k->edge_keys;
    size_t j, count = k->num_border;
    for (j = 0; j < count; j++) {
        const uint8_t *behind = delaunay__behind[border[j] & 3];
        size_t own = border[j] & ~(size_t)3;
        delaunay_handle s = *(slot - j);
        delaunay_tet *w = &tets[s];
        __m128i v = _mm_loadu_si128((const __m128i *)(const void *)(words + 2 * own));
        v = _mm_shuffle_epi8(v, _mm_loadu_si128((const __m128i *)(const void *)behind));
        _mm_storeu_si128((__m128i *)(void *)w->v, _mm_or_si128(v, p4));
        w->n[0] = border[j];
        words[own + border[j] + 4] = 4 * s;
        delaunay__ball_enter(edges, keys[j], vertices, s, w->v + 1, bits);
    }
    delaunay__ball_link(k, slot);
}

static DELAUNAY__TARGET void delaunay__ball_dug(delaunay__kernel *k, delaunay_handle *freed,
                                                uint32_t p)
{
    const delaunay_handle *cavity = k->cavity, *slot = freed - 1;
    delaunay_vertex *vertices = k->vertices;
    uint32_t *words = k->tets[0].v;
    uint8_t *mark = k->mark;
    size_t j, num_cavity = k->num_cavity;
    for (j = 0; j < 4; j++)
        vertices[words[2 * (size_t)cavity[0] + j]].local = (uint32_t)j + 1;
    for (j = 0; j < num_cavity; j++) {
        delaunay_handle h = cavity[j];
        size_t own = h & ~(size_t)3;
        if (j) vertices[words[own + h]].local = (uint32_t)j + 4;
        freed[j] = h >> 2;
        words[2 * own] = 0;
        DELAUNAY__STORE(&mark[h >> 2], 0);
    }
    if (num_cavity <= 28) delaunay__ball_dug_in(k, slot, p, 5);
    else if (num_cavity <= 60) delaunay__ball_dug_in(k, slot, p, 6);
    else delaunay__ball_dug_in(k, slot, p, 7);
}
#  endif

DELAUNAY_API delaunay_plainness delaunay_plain_cavity(delaunay_plain *plain, delaunay_mesh *mesh,
                                                      const double *x, delaunay_handle t,
                                                      const uint32_t *section)
{
#  if defined(DELAUNAY__DIG)
    if (DELAUNAY__AVX2) return delaunay__dig_plain(plain, mesh, x, t, section);
#  endif
    (void)plain;
    (void)mesh;
    (void)x;
    (void)t;
    (void)section;
    return DELAUNAY_NOT_PLAIN;
}

/* Writes the ball of p into the cavity, and the slots of the cavity's tetrahedra to freed. */
static void delaunay__ball_searched(delaunay__kernel *k, delaunay_handle *freed, uint32_t p)
{
    const delaunay_handle *cavity = k->cavity, *slot = freed - 1;
    size_t j, num_cavity = k->num_cavity;
    const uint32_t *v = k->tets[cavity[0] >> 2].v;
    const int big = num_cavity > DELAUNAY__MATRIX_CAVITY || k->num_border > DELAUNAY__MATRIX_FACETS;
    if (big) delaunay__ball_big(k, slot, p);
    for (j = 0; j < 4 && !big; j++)
        if (v[j]) k->vertices[v[j]].local = (uint32_t)j + 1;
    for (j = 0; j < num_cavity; j++) {
        delaunay_handle h = cavity[j], t = h >> 2;
        uint32_t apex = k->tets[t].v[h & 3];
        freed[j] = t;
        k->tets[t].v[0] = 0;
        DELAUNAY__STORE(&k->mark[t], 0);
        if (j && apex && !big) k->vertices[apex].local = (uint32_t)j + 4;
    }
    if (!big) {
        if (num_cavity <= 28) delaunay__ball_small(k, slot, p, 5);
        else if (num_cavity <= 60) delaunay__ball_small(k, slot, p, 6);
        else delaunay__ball_small(k, slot, p, 7);
    }
}

/* Fills the cavity with the ball of p [Marot 2020, 3.6]. */
static void delaunay__ball(delaunay__kernel *k, uint32_t p)
{
    size_t count = k->num_border, num_cavity = k->num_cavity;
    delaunay_handle *freed = k->freed + k->num_freed, *slot = freed - 1;
#  if defined(DELAUNAY__DIG)
    if (k->dug) delaunay__ball_dug(k, freed, p);
    else
#  endif
    delaunay__ball_searched(k, freed, p);
    k->hint = *slot;
    memmove(slot + 1 - count, freed, num_cavity * sizeof *freed);
    k->num_freed = k->num_freed + num_cavity - count;
}

/* Inserts vertex p, which is in no tetrahedron yet. DELAUNAY__NOT_HERE: there is a vertex at the
 * same place or, in a weighted mesh, p is hidden. In a parallel region also DELAUNAY__FOREIGN and
 * DELAUNAY__NEEDS_MEMORY. Nothing has changed unless the result is DELAUNAY_OK. */
static int delaunay__insert(delaunay__kernel *k, uint32_t p)
{
    const double *e = k->vertices[p].x;
    delaunay_handle t = k->hint, behind;
    int result;
    if (k->parallel && delaunay__is_foreign(k, p)) return DELAUNAY__FOREIGN; /* so is its ball */
    if (k->tets[t].v[3] == DELAUNAY_GHOST) { /* its other vertices are in the section */
        behind = k->tets[t].n[3];
        if (k->parallel && delaunay__is_foreign(k, delaunay__apex(k, behind)))
            return DELAUNAY__FOREIGN;
        t = behind >> 2;
    }
    t = delaunay__walk_fast(k, t, e);
    if (t == DELAUNAY_NONE) return DELAUNAY__FOREIGN;
    result = delaunay__cavity(k, t, e);
    if (DELAUNAY__UNLIKELY(result == DELAUNAY__NOT_HERE)) {
        if (k->tets[t].v[3] == DELAUNAY_GHOST) {
            behind = k->tets[t].n[3];
            if (k->parallel && delaunay__is_foreign(k, delaunay__apex(k, behind)))
                return DELAUNAY__FOREIGN;
            t = behind >> 2;
        }
        t = delaunay__walk_exact(k, t, e, p);
        if (t == DELAUNAY_NONE)
            return k->parallel ? (int)DELAUNAY__FOREIGN : (int)DELAUNAY_ERROR_INTERNAL;
        result = delaunay__cavity(k, t, e);
        if (result == DELAUNAY__NOT_HERE && !k->parallel) k->hint = t; /* it has that vertex */
    }
    if (result != DELAUNAY_OK) return result;
    result = delaunay__ball_reserve(k);
    if (result != DELAUNAY_OK) {
        size_t j;
        for (j = 0; j < k->num_cavity; j++) DELAUNAY__STORE(&k->mark[k->cavity[j] >> 2], 0);
        for (j = 0; j < k->num_border; j++) DELAUNAY__STORE(&k->mark[k->border[j] >> 2], 0);
        return result;
    }
    delaunay__ball(k, p);
    return DELAUNAY_OK;
}

/* The tetrahedron of vertices 1 2 3 4, positive, and the four ghosts around it, in slots 1 to 5. */
static void delaunay__first_tet(delaunay_mesh *mesh)
{
    delaunay_handle t, r, i, j;
    delaunay_tet *x = mesh->tets;
    memset((void *)x, 0, 6 * sizeof *x);
    for (i = 0; i < 4; i++) {
        const uint8_t *f = delaunay_facet_vertices[i];
        x[1].v[i] = (uint32_t)i + 1;
        for (j = 0; j < 3; j++) x[2 + i].v[j] = f[j] + 1u;
        x[2 + i].v[3] = DELAUNAY_GHOST;
    }
    for (t = 1; t < 6; t++)
        for (r = 1; r < 6; r++)
            for (i = 0; i < 16 && r != t; i++) {
                uint32_t a = 0, b = 0;
                for (j = 0; j < 4; j++) {
                    if (j != i / 4) a |= 1u << x[t].v[j];
                    if (j != i % 4) b |= 1u << x[r].v[j];
                }
                if (a == b) x[t].n[i / 4] = 4 * r + i % 4;
            }
    mesh->num_tets = 6;
}

/* ---- >>build  order of insertion, duplicates ---------------------------------------------- */
/* Points are inserted in rounds (a BRIO) [Amenta 2003]: the last one has most of them, each earlier
 * one an eighth of the next; within a round they follow the curve. The round comes from a hash of
 * the coordinates, so equal points are in one round, and the order depends on the set of points
 * alone. */
enum { DELAUNAY__FIRST_ROUND = 1000, DELAUNAY__MAX_ROUNDS = 15, DELAUNAY__CURVE_DEPTH = 20 };

static uint64_t delaunay__mix(uint64_t x)
{
    x = (x ^ x >> 31) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 29) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 32;
}

static uint64_t delaunay__hash_point(const double *x)
{
    uint64_t h = 0, bits;
    int i;
    for (i = 0; i < 3; i++) {
        double c = x[i] + 0.0; /* -0 and 0 are one coordinate */
        memcpy(&bits, &c, sizeof bits);
        h = delaunay__mix(h * 3 + bits + UINT64_C(0x9e3779b97f4a7c15));
    }
    return h;
}

static int delaunay__compare_points(const double *a, const double *b)
{
    return delaunay__lexicographic_less(a, b) ? -1 : delaunay__lexicographic_less(b, a);
}

typedef struct delaunay__order {
    delaunay_memory *memory;
    const double *xyz;
    hxtsort_pair *items; /* key; index of the point */
    hxtsort_options sort;
} delaunay__order;

/* Sorts a few points of one cell of the curve by coordinates, equal ones by index. */
static void delaunay__order_few(const delaunay__order *o, size_t begin, size_t end)
{
    size_t i, j;
    for (i = begin + 1; i < end; i++) {
        hxtsort_pair item = o->items[i];
        for (j = i; j > begin; j--) {
            int c = delaunay__compare_points(o->xyz + 3 * item.value,
                                             o->xyz + 3 * o->items[j - 1].value);
            if (c > 0 || (c == 0 && item.value > o->items[j - 1].value)) break;
            o->items[j] = o->items[j - 1];
        }
        o->items[j] = item;
    }
}

/* Sorts the points of one cell of the curve. Many are sorted along a curve through a bounding box
 * of their own, and so on in its cells; if all are equal, by index. */
static delaunay_result delaunay__order_run(delaunay__order *o, size_t begin, size_t end)
{
    size_t i, j, count = end - begin;
    double *xyz;
    uint64_t *keys;
    hilbert_box box;
    hxtsort_result sorted = HXTSORT_OK;
    delaunay_result result = DELAUNAY_OK;
    if (count <= 16) {
        delaunay__order_few(o, begin, end);
        return DELAUNAY_OK;
    }
    xyz = (double *)delaunay_alloc(o->memory, count, 3 * sizeof *xyz);
    keys = (uint64_t *)delaunay_alloc(o->memory, count, sizeof *keys);
    if (!xyz || !keys) {
        delaunay_release(o->memory, xyz);
        delaunay_release(o->memory, keys);
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < count; i++)
        memcpy(xyz + 3 * i, o->xyz + 3 * o->items[begin + i].value, 3 * sizeof *xyz);
    memset(&box, 0, sizeof box);
    (void)hilbert_box_fit3(&box, xyz, 0, count, 1);
    hilbert_box_cube(&box);
    (void)hilbert_keys3(keys, xyz, 0, count, &box, 1);
    for (i = 0; i < count; i++) o->items[begin + i].key = keys[i];
    j = box.lo[0] == box.hi[0] && box.lo[1] == box.hi[1] && box.lo[2] == box.hi[2];
    if (j)
        for (i = 0; i < count; i++) o->items[begin + i].key = o->items[begin + i].value;
    delaunay_release(o->memory, xyz);
    delaunay_release(o->memory, keys);
    sorted = hxtsort_pairs(o->items + begin, count, &o->sort);
    if (sorted != HXTSORT_OK) return (delaunay_result)sorted;
    if (j) return DELAUNAY_OK;
    for (i = begin; i < end && result == DELAUNAY_OK; i = j) {
        for (j = i + 1; j < end && o->items[j].key == o->items[i].key; j++) {}
        if (j - i == count) delaunay__order_few(o, i, j); /* a box that the curve cannot divide */
        else if (j - i > 1) result = delaunay__order_run(o, i, j);
    }
    return result;
}

/* An allocator for calls to other headers or objects: it draws on an object's account, which counts
 * every byte. */
static void *delaunay__counted_alloc(void *user, size_t size)
{
    return delaunay_alloc((delaunay_memory *)user, size, 1);
}

static void delaunay__counted_release(void *user, void *block)
{
    delaunay_release((delaunay_memory *)user, block);
}

/* items: gets the points in order of insertion, equal ones side by side, the lowest index first;
 * round_begin[r]: gets the first item of round r or later, for one more round than there can be;
 * *distinct: 1 if it is certain that no two points are equal. */
static delaunay_result delaunay__order_points(delaunay_memory *memory, const double *xyz,
                                              size_t count, int threads, hxtsort_pair *items,
                                              hilbert_box *box, size_t *round_begin, int *distinct)
{
    delaunay__order o;
    uint64_t *keys = (uint64_t *)delaunay_alloc(memory, count, sizeof *keys);
    size_t i, j, m, r;
    uint64_t rounds = 1;
    int64_t n = (int64_t)count, c;
    delaunay_result result = DELAUNAY_OK;
    if (!keys) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    memset(&o, 0, sizeof o);
    o.memory = memory;
    o.xyz = xyz;
    o.items = items;
    o.sort.num_threads = threads;
    o.sort.allocator.alloc = delaunay__counted_alloc;
    o.sort.allocator.release = delaunay__counted_release;
    o.sort.allocator.user = memory;
    memset(box, 0, sizeof *box);
    (void)hilbert_box_fit3(box, xyz, 0, count, threads);
    hilbert_box_cube(box);
    box->depth = DELAUNAY__CURVE_DEPTH;
    if (hilbert_keys3(keys, xyz, 0, count, box, threads) != HILBERT_OK)
        memset(keys, 0, count * sizeof *keys);
    for (m = count; m / 8 > DELAUNAY__FIRST_ROUND && rounds < DELAUNAY__MAX_ROUNDS; m /= 8)
        rounds++;
    DELAUNAY__OMP(omp parallel for num_threads(threads) schedule(static))
    for (c = 0; c < n; c++) {
        uint64_t h = delaunay__hash_point(xyz + 3 * c), round = rounds - 1;
        for (; round > 0 && (h & 7) == 0; h >>= 3) round--;
        items[c].key = round << 3 * DELAUNAY__CURVE_DEPTH | keys[c];
        items[c].value = (uint64_t)c;
    }
    delaunay_release(memory, keys);
    result = (delaunay_result)hxtsort_pairs(items, count, &o.sort);
    for (r = 0; r <= DELAUNAY__MAX_ROUNDS; r++) { /* the first item of round r or later */
        size_t end = count;
        for (i = 0; i < end;) {
            m = i + (end - i) / 2;
            if (items[m].key >> 3 * DELAUNAY__CURVE_DEPTH < r) i = m + 1;
            else end = m;
        }
        round_begin[r] = i;
    }
    *distinct = 1;
    for (i = 0; i < count && result == DELAUNAY_OK; i = j) {
        for (j = i + 1; j < count && items[j].key == items[i].key; j++) {}
        if (j - i == 1) continue;
        *distinct = 0;
        result = delaunay__order_run(&o, i, j);
    }
    return result;
}

/* Makes vertices of the ordered points, one for each distinct point. Of equal ones it has the
 * lowest index, or the lowest of those with the greatest weight. rounds: gets the rounds' first
 * vertices. */
static void delaunay__place_vertices(delaunay_mesh *mesh, const double *xyz, const double *weights,
                                     const hxtsort_pair *items, size_t count,
                                     const size_t *round_begin, uint32_t *rounds)
{
    size_t i;
    uint32_t v = 0;
    int r = 0;
    for (i = 0; i < count; i++) {
        const double *x = xyz + 3 * items[i].value;
        while (r < DELAUNAY__MAX_ROUNDS && round_begin[r] <= i) rounds[r++] = v + 1;
        if (i + 16 < count) DELAUNAY__PREFETCH(xyz + 3 * items[i + 16].value);
        if (v == 0 || delaunay__compare_points(mesh->vertices[v].x, x) != 0) {
            v++;
            memcpy(mesh->vertices[v].x, x, 3 * sizeof *x);
            mesh->vertices[v].key = mesh->vertices[v].local = 0;
            mesh->vertex_id[v] = (uint32_t)items[i].value;
            if (weights) mesh->weight[v] = weights[items[i].value];
        } else if (weights && weights[items[i].value] > mesh->weight[v]) {
            mesh->vertex_id[v] = (uint32_t)items[i].value;
            mesh->weight[v] = weights[items[i].value];
        }
        mesh->vertex_of[items[i].value] = v;
    }
    while (r <= DELAUNAY__MAX_ROUNDS) rounds[r++] = v + 1;
    mesh->num_vertices = v + 1;
}

/* The same for points of which no two are equal. */
static void delaunay__place_distinct(delaunay_mesh *mesh, const double *xyz, const double *weights,
                                     const hxtsort_pair *items, size_t count,
                                     const size_t *round_begin, uint32_t *rounds, int threads)
{
    int64_t n = (int64_t)count, i;
    int r;
    (void)threads;
    DELAUNAY__OMP(omp parallel for num_threads(threads) schedule(static))
    for (i = 0; i < n; i++) {
        uint32_t id = (uint32_t)items[i].value, v = (uint32_t)i + 1;
        if (i + 16 < n) DELAUNAY__PREFETCH(xyz + 3 * items[i + 16].value);
        memcpy(mesh->vertices[v].x, xyz + 3 * (size_t)id, 3 * sizeof *xyz);
        mesh->vertices[v].key = mesh->vertices[v].local = 0;
        mesh->vertex_id[v] = id;
        mesh->vertex_of[id] = v;
        if (weights) mesh->weight[v] = weights[id];
    }
    for (r = 0; r <= DELAUNAY__MAX_ROUNDS; r++) rounds[r] = (uint32_t)round_begin[r] + 1;
    mesh->num_vertices = (uint32_t)count + 1;
}

/* Swaps two vertices. vertex_of is updated only if no two points have the same vertex. */
static void delaunay__swap_vertices(delaunay_mesh *mesh, uint32_t a, uint32_t b)
{
    delaunay_vertex x = mesh->vertices[a];
    uint32_t id = mesh->vertex_id[a];
    mesh->vertices[a] = mesh->vertices[b];
    mesh->vertices[b] = x;
    mesh->vertex_id[a] = mesh->vertex_id[b];
    mesh->vertex_id[b] = id;
    if (mesh->weight) {
        double w = mesh->weight[a];
        mesh->weight[a] = mesh->weight[b];
        mesh->weight[b] = w;
    }
    if (mesh->num_points == mesh->num_vertices - 1) {
        mesh->vertex_of[mesh->vertex_id[a]] = a;
        mesh->vertex_of[mesh->vertex_id[b]] = b;
    }
}

/* Moves four affinely independent vertices, positively oriented, to the front. Returns the affine
 * dimension of all vertices. */
static int delaunay__first_four(delaunay_mesh *mesh)
{
    uint32_t n = mesh->num_vertices, v;
    const delaunay_vertex *x = mesh->vertices;
    if (n < 2) return -1;
    if (n < 3) return 0;
    for (v = 3; v < n && delaunay_collinear(x[1].x, x[2].x, x[v].x); v++) {}
    if (v >= n) return 1;
    if (v != 3) delaunay__swap_vertices(mesh, 3, v);
    for (v = 4; v < n && delaunay_orient3d(x[1].x, x[2].x, x[3].x, x[v].x) == 0; v++) {}
    if (v >= n) return 2;
    if (v != 4) delaunay__swap_vertices(mesh, 4, v);
    if (delaunay_orient3d(x[1].x, x[2].x, x[3].x, x[4].x) < 0) delaunay__swap_vertices(mesh, 1, 2);
    return 3;
}

/* Whether all coordinates are small multiples, from the least ones on, of one power of two, the
 * unit. With differences of less than 660 units, so at most 659, an in-sphere determinant is at
 * most 72 * 659^5 < 2^53 units^5, and exact in doubles, every intermediate result included.
 * The difference from the least one may have been rounded: it was not if both sum and difference
 * lead back, as one of the two is then exact [Dekker 1971]. */
static int delaunay__exact_in_doubles(const delaunay_mesh *mesh)
{
    double lo[3], hi[3], extent = 0, unit;
    uint32_t v;
    int i, e;
    if (mesh->num_vertices < 2 || mesh->weight) return 0;
    memcpy(lo, mesh->vertices[1].x, sizeof lo);
    memcpy(hi, lo, sizeof hi);
    for (v = 2; v < mesh->num_vertices; v++)
        for (i = 0; i < 3; i++) {
            double c = mesh->vertices[v].x[i];
            lo[i] = c < lo[i] ? c : lo[i];
            hi[i] = c > hi[i] ? c : hi[i];
        }
    for (i = 0; i < 3; i++) extent = hi[i] - lo[i] > extent ? hi[i] - lo[i] : extent;
    if (!(extent > 1e-30 && extent < 1e30)) return 0;
    (void)frexp(extent / 660, &e);
    unit = ldexp(1, e); /* extent is between 330 and 660 units */
    for (v = 1; v < mesh->num_vertices; v++)
        for (i = 0; i < 3; i++) {
            double x = mesh->vertices[v].x[i], d = x - lo[i], c = d / unit;
            if (c != floor(c) || lo[i] + d != x || x - d != lo[i]) return 0;
        }
    return 1;
}

/* ---- >>numbering  the same slots for any number of threads -------------------------------- */

/* The rotation (even permutation) of a tetrahedron that puts its greatest vertex first and, if it
 * is real, the greatest of the others second; the ghost stays last. out[i]: which corner becomes
 * corner i. With one thread the greatest vertex of a tetrahedron was inserted last, so tetrahedra
 * sorted by their greatest vertices are nearly in the order in which they were made, and few move
 * far. */
static void delaunay__canonical_rotation(const uint32_t *v, uint8_t *out)
{
    static const uint8_t first[4][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 0, 1, 3}, {3, 0, 2, 1}};
    const uint8_t *f;
    int i, m = 0, s;
    if (v[3] == DELAUNAY_GHOST) {
        m = v[0] > v[1] ? (v[0] > v[2] ? 0 : 2) : (v[1] > v[2] ? 1 : 2);
        for (i = 0; i < 3; i++) out[i] = (uint8_t)((m + i) % 3);
        out[3] = 3;
        return;
    }
    for (i = 1; i < 4; i++)
        if (v[i] > v[m]) m = i;
    f = first[m];
    s = v[f[1]] > v[f[2]] ? (v[f[1]] > v[f[3]] ? 0 : 2) : (v[f[2]] > v[f[3]] ? 1 : 2);
    out[0] = f[0];
    for (i = 0; i < 3; i++) out[i + 1] = f[1 + (s + i) % 3];
}

/* All rotations: number 0 for deleted tetrahedra, then 12 for real ones, then 3 for ghosts. index:
 * the number of a rotation by its code, the results of comparing all pairs of vertices and whether
 * the last one is the ghost. inverse: the second half repeats the first, for marks to which
 * DELAUNAY__PLACED was added. */
enum { DELAUNAY__GHOST_CODE = 64, DELAUNAY__GHOST_ROTATION = 13, DELAUNAY__PLACED = 16 };
typedef struct delaunay__rotations {
    uint8_t index[128], order[16][4], inverse[2 * DELAUNAY__PLACED][4];
    uint8_t bytes[16][16];      /* the order of the bytes of four corners; number 0 gives zeros */
    uint8_t packed_inverse[16]; /* two bits a corner */
    int num;
} delaunay__rotations;

static unsigned delaunay__rotation_code(const uint32_t *v)
{
    return (unsigned)(v[0] > v[1]) | (unsigned)(v[1] > v[2]) << 1 | (unsigned)(v[2] > v[3]) << 2 |
           (unsigned)(v[3] > v[0]) << 3 | (unsigned)(v[0] > v[2]) << 4 |
           (unsigned)(v[1] > v[3]) << 5 | (v[3] == DELAUNAY_GHOST ? DELAUNAY__GHOST_CODE : 0);
}

/* Adds the rotation of a tetrahedron with these vertices, unless it is there already. */
static void delaunay__rotations_add(delaunay__rotations *r, const uint32_t *v)
{
    uint8_t order[4], i, k;
    int j;
    delaunay__canonical_rotation(v, order);
    for (j = v[3] == DELAUNAY_GHOST ? DELAUNAY__GHOST_ROTATION : 1; j < r->num; j++)
        if (memcmp(r->order[j], order, sizeof order) == 0) break;
    if (j == r->num) r->num++;
    memcpy(r->order[j], order, sizeof order);
    r->packed_inverse[j] = 0;
    for (i = 0; i < 4; i++) {
        r->inverse[j][order[i]] = i;
        r->packed_inverse[j] = (uint8_t)(r->packed_inverse[j] | i << 2 * order[i]);
        for (k = 0; k < 4; k++) r->bytes[j][4 * i + k] = (uint8_t)(4 * order[i] + k);
    }
    r->index[delaunay__rotation_code(v)] = (uint8_t)j;
}

static void delaunay__rotations_init(delaunay__rotations *r)
{
    uint32_t v[4], code, i;
    int ghost;
    memset(r, 0, sizeof *r);
    memset(r->bytes[0], 128, sizeof r->bytes[0]);
    r->num = 1;
    for (ghost = 0; ghost < 2; ghost++)
        for (code = 0; code < 256; code++) { /* all orders of four */
            for (i = 0; i < 4; i++) v[i] = (code >> 2 * i & 3) + 1;
            if (v[0] == v[1] || v[0] == v[2] || v[0] == v[3] || v[1] == v[2] || v[1] == v[3] ||
                v[2] == v[3])
                continue;
            if (ghost) v[3] = DELAUNAY_GHOST;
            delaunay__rotations_add(r, v);
        }
    memcpy(r->inverse[DELAUNAY__PLACED], r->inverse, DELAUNAY__PLACED * sizeof *r->inverse);
}

static uint16_t delaunay__rotate_flags(uint16_t flags, const uint8_t *order)
{
    unsigned out = flags & DELAUNAY_STAGE_BITS;
    int i, j;
    for (i = 0; i < 4; i++) {
        if (flags & DELAUNAY_FACET_BIT(order[i])) out |= DELAUNAY_FACET_BIT(i);
        for (j = i + 1; j < 4; j++)
            if (flags & DELAUNAY_EDGE_BIT(delaunay_edge_between(order[i], order[j])))
                out |= DELAUNAY_EDGE_BIT(delaunay_edge_between(i, j));
    }
    return (uint16_t)out;
}

/* The real tetrahedra, or the ghosts, that have the same greatest vertex form a bucket, a linked
 * list of slots. A large one is worth a radix sort; from: the first of its new slots. */
typedef struct delaunay__large_bucket {
    delaunay_handle head, from;
} delaunay__large_bucket;

typedef struct delaunay__numbering {
    delaunay_mesh *mesh;
    delaunay__rotations rotations;
    delaunay_handle *moved; /* of each slot: at first the next slot in its bucket, later its own new
                             * slot */
    delaunay_handle *heads; /* of each vertex: the first slot of its bucket of real tetrahedra,
                             * later of ghosts; finally spare memory */
    uint32_t *keys;         /* of each slot: its delaunay__short_key; finally spare memory */
    size_t *counts;         /* of each thread and chunk of vertices: real tetrahedra and ghosts */
    size_t num_chunks;
    uint16_t *owner;        /* of each chunk: the thread that fills and sorts its buckets */
    delaunay_handle *others; /* of each thread: a list of its slots that go to others' buckets */
    delaunay__large_bucket *large;
    size_t num_large;
    delaunay_handle *spare; /* memory of keys and heads: a handle for each slot, and each vertex */
    size_t cap_spare;
    int threads;
    int simd;               /* moved has the rotation, too, in the bits beyond slot_mask */
    delaunay_handle slot_mask;
} delaunay__numbering;

enum {
    DELAUNAY__MANY_TETS = 300, /* more in a bucket are worth a radix sort */
    DELAUNAY__BATCH = 512,     /* buckets at most in a batch, and about so many tetrahedra */
    DELAUNAY__CHUNK = 4096,    /* vertices; a power of two */
    DELAUNAY__PACKED_BITS = 28
};

/* The share of thread i in the slots: *from to *end-1. */
static void delaunay__slots_of(const delaunay__numbering *c, int i, size_t *from, size_t *end)
{
    size_t slots = c->mesh->num_tets - 1, each = slots / (size_t)c->threads;
    *from = 1 + each * (size_t)i;
    *end = i + 1 == c->threads ? slots + 1 : *from + each;
}

/* Puts slot t at the head of a list, and returns the slot that was there. shared: other threads may
 * do the same. */
DELAUNAY_INLINE delaunay_handle delaunay__put_first(delaunay_handle *head, delaunay_handle t,
                                                    const int shared)
{
    delaunay_handle was;
#  if DELAUNAY__PARALLEL
    if (shared) return __atomic_exchange_n(head, t, __ATOMIC_RELAXED);
#  endif
    (void)shared;
    was = *head;
    *head = t;
    return was;
}

/* The key by which a bucket's tetrahedra are sorted, made of their second and third vertices. It is
 * very rare that two keys are equal; then the vertices decide. Keys are compared as signed numbers,
 * or as unsigned ones with the first bit flipped. */
#  ifndef DELAUNAY__SHORT_KEY_MASK
#    define DELAUNAY__SHORT_KEY_MASK 0xffffffffu /* less: for tests */
#  endif
DELAUNAY_INLINE uint32_t delaunay__short_key(uint32_t second, uint32_t third)
{
    return (second * 0x9e3779b1u + third * 0x85ebca6bu) & DELAUNAY__SHORT_KEY_MASK;
}

/* The head of the list to which a slot belongs: the bucket of its greatest vertex, if that is the
 * thread's own or there is only one thread; else the list of slots for others' buckets. */
DELAUNAY_INLINE delaunay_handle *delaunay__head_of(const delaunay__numbering *c, size_t greatest,
                                                   int thread, delaunay_handle *others,
                                                   const int shared)
{
    if (shared && c->owner[greatest / DELAUNAY__CHUNK] != thread) return others;
    return &c->heads[greatest];
}

/* For slots t to end-1, the share of a thread: puts rotations into mark, keys into keys, and real
 * tetrahedra into their buckets; counts real ones and ghosts. The bucket of vertex 0 has the
 * deleted slots. Returns the first of the slots that belong to others' buckets, a list. */
static DELAUNAY__NOINLINE delaunay_handle delaunay__find_plain(const delaunay__numbering *c,
                                                               size_t t, size_t end, size_t *counts,
                                                               int thread)
{
    const delaunay_mesh *mesh = c->mesh;
    delaunay_handle others = 0, ghosts = 0; /* ghosts: head of a list that nobody reads */
    while (end-- > t) {
        const uint32_t *v = mesh->tets[end].v;
        unsigned r = v[0] ? c->rotations.index[delaunay__rotation_code(v)] : 0;
        const uint8_t *order = c->rotations.order[r];
        size_t greatest = v[order[0]], ghost = r >= DELAUNAY__GHOST_ROTATION;
        mesh->mark[end] = (uint8_t)r;
        c->keys[end] = delaunay__short_key(v[order[1]], v[order[2]]);
        c->moved[end] = delaunay__put_first(
            ghost ? &ghosts : delaunay__head_of(c, greatest, thread, &others, c->threads > 1),
            (delaunay_handle)end, 0);
        counts[2 * (greatest / DELAUNAY__CHUNK) + ghost] += r != 0;
    }
    return others;
}

#  if defined(DELAUNAY__AVX2) && !defined(DELAUNAY_INDEX64)
/* The same with all comparisons at once. They are signed, so the first bits are flipped. */
DELAUNAY__TARGET DELAUNAY__ALWAYS_INLINE delaunay_handle
delaunay__find_avx2_in(const delaunay__numbering *c, size_t t, size_t end, size_t *counts,
                       int thread, const int shared)
{
    const __m128i first_bit = _mm_set1_epi32(INT32_MIN), zero = _mm_setzero_si128();
    const delaunay_tet *tets = c->mesh->tets;
    const uint8_t *index = c->rotations.index;
    uint8_t *mark = c->mesh->mark;
    delaunay_handle *moved = c->moved, others = 0, ghosts = 0;
    uint32_t *keys = c->keys;
    while (end-- > t) {
        __m128i v = _mm_loadu_si128((const __m128i *)(const void *)tets[end].v);
        __m128i s = _mm_xor_si128(v, first_bit);
        __m128i next = _mm_cmpgt_epi32(s, _mm_shuffle_epi32(s, 0x39));
        __m128i over = _mm_cmpgt_epi32(s, _mm_shuffle_epi32(s, 0x4e));
        int none = _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(v, zero)));
        int code = _mm_movemask_ps(_mm_castsi128_ps(next)) |
                   (_mm_movemask_ps(_mm_castsi128_ps(over)) & 3) << 4 | (none & 8) << 3;
        unsigned r = none & 1 ? 0 : index[code];
        const uint8_t *order = c->rotations.order[r];
        size_t greatest = tets[end].v[order[0]]; /* of a deleted one: v[0], which is 0 */
        size_t ghost = r >= DELAUNAY__GHOST_ROTATION;
        delaunay_handle *head = delaunay__head_of(c, greatest, thread, &others, shared);
        mark[end] = (uint8_t)r;
        keys[end] = delaunay__short_key(tets[end].v[order[1]], tets[end].v[order[2]]);
        moved[end] = delaunay__put_first(ghost ? &ghosts : head, (delaunay_handle)end, 0) |
                     r << DELAUNAY__PACKED_BITS;
        counts[2 * (greatest / DELAUNAY__CHUNK) + ghost] += r != 0;
    }
    return others;
}

static DELAUNAY__TARGET DELAUNAY__NOINLINE delaunay_handle
delaunay__find_avx2(const delaunay__numbering *c, size_t t, size_t end, size_t *counts, int thread)
{
    if (c->threads > 1) return delaunay__find_avx2_in(c, t, end, counts, thread, 1);
    return delaunay__find_avx2_in(c, t, end, counts, thread, 0);
}
#  endif

/* Makes each chunk the own one of the thread that has most of its tetrahedra, as samples show. */
static void delaunay__choose_owners(const delaunay__numbering *c)
{
    enum { DELAUNAY__SAMPLE = 256 }; /* slots; a chunk has some 27000 tetrahedra */
    const size_t each = 2 * c->num_chunks;
    size_t chunk;
    int i;
    memset(c->owner, 0, c->num_chunks * sizeof *c->owner);
    if (c->threads == 1) return;
    DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static, 1))
    for (i = 0; i < c->threads; i++) {
        size_t t, end, *counts = c->counts + each * (size_t)i;
        delaunay__slots_of(c, i, &t, &end);
        for (; t < end; t += DELAUNAY__SAMPLE) {
            const uint32_t *v = c->mesh->tets[t].v;
            uint8_t order[4];
            if (v[0] == 0) continue; /* deleted: the others may be anything */
            delaunay__canonical_rotation(v, order);
            counts[2 * (v[order[0]] / DELAUNAY__CHUNK)]++;
        }
    }
    for (chunk = 0; chunk < c->num_chunks; chunk++) {
        const size_t *counts = c->counts + 2 * chunk;
        for (i = 1; i < c->threads; i++)
            if (counts[each * (size_t)i] > counts[each * c->owner[chunk]])
                c->owner[chunk] = (uint16_t)i;
    }
    memset(c->counts, 0, each * (size_t)c->threads * sizeof *c->counts);
}

/* Puts the slots of a list into their buckets; other threads do the same. */
static void delaunay__list_others(const delaunay__numbering *c, delaunay_handle t)
{
    while (t) {
        delaunay_handle *moved = &c->moved[t], rotation = *moved & ~c->slot_mask,
                        next = *moved & c->slot_mask;
        uint32_t greatest = c->mesh->tets[t].v[c->rotations.order[c->mesh->mark[t]][0]];
        *moved = rotation | delaunay__put_first(&c->heads[greatest], t, 1);
        t = next;
    }
}

/* At first each thread fills the buckets of its own vertices, without any communication. Where the
 * slots are nearly in order, few tetrahedra remain for the buckets of others. */
static DELAUNAY__NOINLINE void delaunay__find_rotations(const delaunay__numbering *c)
{
    delaunay_mesh *mesh = c->mesh;
    int i;
    delaunay__choose_owners(c);
    DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static, 1) if(c->threads > 1))
    for (i = 0; i < c->threads; i++) {
        size_t t, end, *counts = c->counts + 2 * c->num_chunks * (size_t)i;
        delaunay__slots_of(c, i, &t, &end);
#  if defined(DELAUNAY__AVX2) && !defined(DELAUNAY_INDEX64)
        if (c->simd) c->others[i] = delaunay__find_avx2(c, t, end, counts, i);
        else
#  endif
            c->others[i] = delaunay__find_plain(c, t, end, counts, i);
        for (; mesh->flags && t < end; t++)
            mesh->flags[t] =
                delaunay__rotate_flags(mesh->flags[t], c->rotations.order[mesh->mark[t]]);
    }
    DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static, 1) if(c->threads > 1))
    for (i = 0; i < c->threads; i++) delaunay__list_others(c, c->others[i]);
}

/* Replaces the counts of the first thread by the first new slot of each chunk; ghosts come after
 * all real tetrahedra. Returns the end of the new slots. */
static size_t delaunay__add_up(const delaunay__numbering *c)
{
    size_t sum = 1, ghost, chunk;
    for (ghost = 0; ghost < 2; ghost++)
        for (chunk = 0; chunk < c->num_chunks; chunk++) {
            size_t begin = sum;
            int i;
            for (i = 0; i < c->threads; i++)
                sum += c->counts[2 * (c->num_chunks * (size_t)i + chunk) + ghost];
            c->counts[2 * chunk + ghost] = begin;
        }
    return sum;
}

/* Second and third vertex in canonical order of the tetrahedron in slot t. */
static uint64_t delaunay__second_key(const delaunay__numbering *c, delaunay_handle t)
{
    const uint32_t *v = c->mesh->tets[t].v;
    const uint8_t *order = c->rotations.order[c->mesh->mark[t]];
    return (uint64_t)v[order[1]] << 32 | v[order[2]];
}

/* Sets the new slot of the tetrahedron in an old slot; with simd slot has the rotation, too. */
DELAUNAY_INLINE void delaunay__set_place(const delaunay__numbering *c, delaunay_handle slot,
                                         size_t to)
{
    c->moved[slot & c->slot_mask] = (delaunay_handle)to | (slot & ~c->slot_mask);
}

/* Sorts the n tetrahedra of a bucket by their second and third vertices. */
static DELAUNAY__NOINLINE void delaunay__sort_ties(const delaunay__numbering *c,
                                                   const delaunay_handle *slot, size_t n,
                                                   size_t begin)
{
    uint64_t key[DELAUNAY__MANY_TETS];
    size_t i, j, rank;
    for (i = 0; i < n; i++) key[i] = delaunay__second_key(c, slot[i] & c->slot_mask);
    for (i = 0; i < n; i++) {
        for (rank = j = 0; j < n; j++) rank += key[j] < key[i];
        delaunay__set_place(c, slot[i], begin + rank);
    }
}

/* Sorts the n tetrahedra of a bucket by their keys; their new slots are from begin on. The rank of
 * a key is the number of smaller ones, counted without branches. The sum of all ranks is
 * n (n - 1) / 2 unless two keys are equal. */
static void delaunay__sort_bucket(const delaunay__numbering *c, const delaunay_handle *slot,
                                  const uint32_t *key, size_t n, size_t begin)
{
    const uint32_t first_bit = 0x80000000u;
    size_t i, j, sum = 0;
    for (i = 0; i < n; i++) {
        uint32_t rank = 0, own = key[i] ^ first_bit;
        for (j = 0; j < n; j++) rank += (key[j] ^ first_bit) < own;
        delaunay__set_place(c, slot[i], begin + rank);
        sum += rank;
    }
    if (2 * sum + n != n * n) delaunay__sort_ties(c, slot, n, begin);
}

#  if defined(DELAUNAY__AVX2) && !defined(DELAUNAY_INDEX64)
/* The same for up to 8 * eights tetrahedra. The slots that follow them in the batch, up to rest
 * slots in all, get wrong places, too, which are overwritten later. */
DELAUNAY__TARGET DELAUNAY__ALWAYS_INLINE void
delaunay__sort_fixed(const delaunay__numbering *c, const delaunay_handle *slot, const uint32_t *key,
                     size_t n, size_t rest, size_t begin, const int eights)
{
    const __m256i most = _mm256_set1_epi32(INT32_MAX), n8 = _mm256_set1_epi32((int)n);
    const uint32_t mask = ((uint32_t)1 << DELAUNAY__PACKED_BITS) - 1;
    __m256i k[4], rank[4], at = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), sum;
    uint32_t keys[32], places[32], all = (uint32_t)(8 * eights), count, i;
    int j;
    for (j = 0; j < eights; j++) {
        k[j] = _mm256_loadu_si256((const __m256i *)(const void *)(key + 8 * j));
        k[j] = _mm256_blendv_epi8(most, k[j], _mm256_cmpgt_epi32(n8, at));
        at = _mm256_add_epi32(at, _mm256_set1_epi32(8));
        _mm256_storeu_si256((__m256i *)(void *)(keys + 8 * j), k[j]);
        rank[j] = _mm256_setzero_si256();
    }
    for (i = 0; i < all; i++) {
        __m256i x = _mm256_set1_epi32((int)keys[i]);
        for (j = 0; j < eights; j++)
            rank[j] = _mm256_sub_epi32(rank[j], _mm256_cmpgt_epi32(k[j], x));
    }
    sum = rank[0];
    for (j = 1; j < eights; j++) sum = _mm256_add_epi32(sum, rank[j]);
    for (j = 0; j < eights; j++)
        _mm256_storeu_si256((__m256i *)(void *)(places + 8 * j),
                            _mm256_add_epi32(rank[j], _mm256_set1_epi32((int)begin)));
    count = rest < all ? (uint32_t)rest : all;
    for (i = 0; i < count; i++) c->moved[slot[i] & mask] = places[i] | (slot[i] & ~mask);
    _mm256_storeu_si256((__m256i *)(void *)places, sum);
    for (i = 1; i < 8; i++) places[0] += places[i];
    if (2 * (size_t)places[0] + n != n * n + 2 * n * (all - n)) /* rank of all others: n */
        delaunay__sort_ties(c, slot, n, begin);
}

static DELAUNAY__TARGET void delaunay__sort_bucket_avx2(const delaunay__numbering *c,
                                                        const delaunay_handle *slot,
                                                        const uint32_t *key, size_t n, size_t rest,
                                                        size_t begin)
{
    if (n <= 8) delaunay__sort_fixed(c, slot, key, n, rest, begin, 1);
    else if (n <= 16) delaunay__sort_fixed(c, slot, key, n, rest, begin, 2);
    else if (n <= 24) delaunay__sort_fixed(c, slot, key, n, rest, begin, 3);
    else if (n <= 32) delaunay__sort_fixed(c, slot, key, n, rest, begin, 4);
    else delaunay__sort_bucket(c, slot, key, n, begin);
}
#  endif

/* The slot after t in its bucket. *slot: t, with simd together with its rotation. */
DELAUNAY_INLINE delaunay_handle delaunay__next_slot(const delaunay__numbering *c, delaunay_handle t,
                                                    delaunay_handle *slot)
{
    delaunay_handle next = c->moved[t];
    *slot = t | (next & ~c->slot_mask);
    return next & c->slot_mask;
}

/* Sorts the large buckets one by one. Returns 0 if out of memory. */
static int delaunay__sort_large_buckets(const delaunay__numbering *c)
{
    delaunay_memory *m = &c->mesh->memory;
    hxtsort_options sort;
    size_t b, i;
    int ok = 1;
    memset(&sort, 0, sizeof sort);
    sort.num_threads = c->threads;
    sort.allocator.alloc = delaunay__counted_alloc;
    sort.allocator.release = delaunay__counted_release;
    sort.allocator.user = m;
    for (b = 0; b < c->num_large && ok; b++) {
        size_t n = 0, from = c->large[b].from;
        delaunay_handle t = c->large[b].head;
        hxtsort_pair *pairs;
        while (t) t = delaunay__next_slot(c, t, &c->spare[n++]);
        pairs = (hxtsort_pair *)delaunay_alloc(m, n, sizeof *pairs);
        for (i = 0; pairs && i < n; i++) {
            pairs[i].value = c->spare[i];
            pairs[i].key = delaunay__second_key(c, c->spare[i] & c->slot_mask);
        }
        ok = pairs && hxtsort_pairs(pairs, n, &sort) == HXTSORT_OK;
        for (i = 0; ok && i < n; i++)
            delaunay__set_place(c, (delaunay_handle)pairs[i].value, from + i);
        delaunay_release(m, pairs);
    }
    return ok;
}

static void delaunay__keep_large(delaunay__numbering *c, delaunay_handle head, size_t from)
{
#  if DELAUNAY__PARALLEL
    size_t b = DELAUNAY__FETCH_ADD(&c->num_large, 1);
#  else
    size_t b = c->num_large++;
#  endif
    c->large[b].head = head;
    c->large[b].from = (delaunay_handle)from;
}

/* A batch: several buckets, one after the other in one array. */
typedef struct delaunay__batch_of_lists {
    delaunay_handle slot[DELAUNAY__BATCH + DELAUNAY__MANY_TETS];
    uint32_t key[DELAUNAY__BATCH + DELAUNAY__MANY_TETS + 32];
    uint32_t end[DELAUNAY__BATCH]; /* of each bucket */
    size_t num;
} delaunay__batch_of_lists;

/* Fills a batch with the buckets of the vertices from v on, as many as fit, to a large one, which
 * is left out. If the first one is large, the batch stays empty: that bucket is kept for later, and
 * its new slots, from *from on, are skipped. Returns the next vertex. */
static uint32_t delaunay__fill_batch(delaunay__numbering *c, delaunay__batch_of_lists *b,
                                     uint32_t v, uint32_t end, size_t *from)
{
    const delaunay_handle *heads = c->heads;
    enum { DELAUNAY__AHEAD = 16 };
    size_t n = 0;
    for (b->num = 0; v < end && b->num < DELAUNAY__BATCH && n < DELAUNAY__BATCH; v++) {
        size_t first = n;
        delaunay_handle t = heads[v], ahead;
        if (!t) continue;
        ahead = heads[v + DELAUNAY__AHEAD < end ? v + DELAUNAY__AHEAD : v];
        DELAUNAY__PREFETCH(&c->moved[ahead]);
        DELAUNAY__PREFETCH(&c->keys[ahead]);
        ahead = heads[v + DELAUNAY__AHEAD / 2 < end ? v + DELAUNAY__AHEAD / 2 : v];
        ahead = c->moved[ahead] & c->slot_mask;
        DELAUNAY__PREFETCH(&c->moved[ahead]);
        DELAUNAY__PREFETCH(&c->keys[ahead]);
        for (; t && n - first < DELAUNAY__MANY_TETS; n++) {
            b->key[n] = c->keys[t];
            t = delaunay__next_slot(c, t, &b->slot[n]);
        }
        if (t) {
            if (b->num) return v;
            delaunay__keep_large(c, heads[v], *from);
            for (*from += n; t; t = c->moved[t] & c->slot_mask) ++*from;
            return v + 1;
        }
        b->end[b->num++] = (uint32_t)n;
    }
    return v;
}

/* New slots, beginning with from, for the buckets of vertices v to end-1, except for large ones. */
static void delaunay__sort_chunk(delaunay__numbering *c, uint32_t v, uint32_t end, size_t from)
{
    delaunay__batch_of_lists b;
    memset(b.key, 0, sizeof b.key);
    while (v < end) {
        size_t i, l, n;
        v = delaunay__fill_batch(c, &b, v, end, &from);
        n = b.num ? b.end[b.num - 1] : 0;
        for (i = l = 0; l < b.num; i = b.end[l++]) {
            size_t count = b.end[l] - i;
#  if defined(DELAUNAY__AVX2) && !defined(DELAUNAY_INDEX64)
            if (c->simd)
                delaunay__sort_bucket_avx2(c, b.slot + i, b.key + i, count, n - i, from + i);
            else
#  endif
                delaunay__sort_bucket(c, b.slot + i, b.key + i, count, from + i);
        }
        from += n;
    }
}

/* New slots for the tetrahedra in all buckets, which are those of real ones or of ghosts. Each
 * thread goes through its own chunks. */
static DELAUNAY__NOINLINE void delaunay__sort_buckets(delaunay__numbering *c, int ghosts)
{
    const uint32_t n = c->mesh->num_vertices;
    int i;
    DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static, 1) if(c->threads > 1))
    for (i = 0; i < c->threads; i++) {
        size_t chunk;
        for (chunk = 0; chunk < c->num_chunks; chunk++) {
            uint32_t v = (uint32_t)chunk * DELAUNAY__CHUNK,
                     end = n - v < DELAUNAY__CHUNK ? n : v + DELAUNAY__CHUNK;
            if (c->owner[chunk] == i)
                delaunay__sort_chunk(c, v ? v : 1, end, c->counts[2 * chunk + (ghosts != 0)]);
        }
    }
}

/* Deleted slots, which are in the bucket of vertex 0, get no new slot. */
static void delaunay__drop_deleted(const delaunay__numbering *c)
{
    delaunay_handle t, next;
    for (t = c->heads[0]; t; t = next) {
        next = c->moved[t] & c->slot_mask;
        c->moved[t] = DELAUNAY_NONE;
    }
}

/* The slot of the next ghost after t, or one between t and it. Tests eight marks at a time. */
static size_t delaunay__skip_real(const uint8_t *mark, size_t t, size_t end)
{
    const uint64_t ones = UINT64_C(0x0101010101010101);
    const uint64_t more = ones * (128 - DELAUNAY__GHOST_ROTATION);
    uint64_t marks;
    for (t++; t + 8 <= end; t += 8) {
        memcpy(&marks, mark + t, 8);
        if ((marks + more) & ones << 7) break;
    }
    return t;
}

/* Puts the ghosts into their buckets, in place of the real tetrahedra. */
static DELAUNAY__NOINLINE void delaunay__list_ghosts(const delaunay__numbering *c)
{
    const uint8_t *mark = c->mesh->mark;
    int i;
    memset(c->heads, 0, c->mesh->num_vertices * sizeof *c->heads);
    DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static, 1) if(c->threads > 1))
    for (i = 0; i < c->threads; i++) {
        size_t t, end;
        delaunay__slots_of(c, i, &t, &end);
        for (t--; (t = delaunay__skip_real(mark, t, end)) < end;) {
            delaunay_handle rotation = c->moved[t] & ~c->slot_mask;
            uint32_t greatest;
            if (mark[t] < DELAUNAY__GHOST_ROTATION) continue;
            greatest = c->mesh->tets[t].v[c->rotations.order[mark[t]][0]];
            c->moved[t] = rotation | delaunay__put_first(&c->heads[greatest], (delaunay_handle)t,
                                                         c->threads > 1);
        }
    }
}

/* Writes the tetrahedra of count slots from t on to y, with corners in canonical order and handles
 * that refer to the new slots and corners; y may be the place where they are. For deleted slots
 * what is written has no meaning. */
static DELAUNAY__NOINLINE void delaunay__renumber_plain(const delaunay__numbering *c, size_t t,
                                                        size_t count, delaunay_tet *y)
{
    const uint8_t *mark = c->mesh->mark;
    size_t end = t + count;
    for (; t < end; t++, y++) {
        const uint8_t *order = c->rotations.order[mark[t] % DELAUNAY__PLACED];
        const delaunay_tet x = c->mesh->tets[t];
        int i;
        if (mark[t] == 0) continue;
        for (i = 0; i < 4; i++) { /* handle 0 stays 0 */
            delaunay_handle h = x.n[order[i]];
            y->v[i] = x.v[order[i]];
            y->n[i] = 4 * c->moved[h >> 2] + c->rotations.inverse[mark[h >> 2]][h & 3];
        }
    }
}

#  if defined(DELAUNAY__AVX2) && !defined(DELAUNAY_INDEX64)
/* The same, four corners at once. */
static DELAUNAY__TARGET DELAUNAY__NOINLINE void
delaunay__renumber_avx2(const delaunay__numbering *c, size_t t, size_t count, delaunay_tet *y)
{
    enum { DELAUNAY__AHEAD = 32 };
    const __m128i three = _mm_set1_epi32(3);
    const delaunay_tet *tets = c->mesh->tets;
    const int *moved = (const int *)(const void *)c->moved;
    const __m128i inverses =
        _mm_loadu_si128((const __m128i *)(const void *)c->rotations.packed_inverse);
    /* beyond known, slots may be changed by other threads */
    size_t end = t + count, known = c->threads == 1 ? c->mesh->num_tets : end;
    for (; t < end; t++, y++) {
        const delaunay_handle *n = tets[t + DELAUNAY__AHEAD < known ? t + DELAUNAY__AHEAD : t].n;
        const uint8_t *bytes = c->rotations.bytes[(unsigned)moved[t] >> DELAUNAY__PACKED_BITS];
        __m128i o = _mm_loadu_si128((const __m128i *)(const void *)bytes);
        __m128i v = _mm_loadu_si128((const __m128i *)(const void *)tets[t].v);
        __m128i h = _mm_loadu_si128((const __m128i *)(const void *)tets[t].n), w, f;
        DELAUNAY__PREFETCH(&moved[n[0] >> 2]);
        DELAUNAY__PREFETCH(&moved[n[1] >> 2]);
        DELAUNAY__PREFETCH(&moved[n[2] >> 2]);
        DELAUNAY__PREFETCH(&moved[n[3] >> 2]);
        h = _mm_shuffle_epi8(h, o);
        f = _mm_srli_epi32(h, 2);
        w = _mm_setr_epi32(moved[(unsigned)_mm_extract_epi32(f, 0)],
                           moved[(unsigned)_mm_extract_epi32(f, 1)],
                           moved[(unsigned)_mm_extract_epi32(f, 2)],
                           moved[(unsigned)_mm_extract_epi32(f, 3)]);
        f = _mm_shuffle_epi8(inverses, _mm_srli_epi32(w, DELAUNAY__PACKED_BITS));
        f = _mm_srlv_epi32(f, _mm_slli_epi32(_mm_and_si128(h, three), 1));
        h = _mm_or_si128(_mm_srli_epi32(_mm_slli_epi32(w, 32 - DELAUNAY__PACKED_BITS),
                                        30 - DELAUNAY__PACKED_BITS),
                         _mm_and_si128(f, three));
        _mm_storeu_si128((__m128i *)(void *)y->v, _mm_shuffle_epi8(v, o));
        _mm_storeu_si128((__m128i *)(void *)y->n, h);
    }
}
#  endif

static void delaunay__renumber(const delaunay__numbering *c, size_t t, size_t count,
                               delaunay_tet *y)
{
#  if defined(DELAUNAY__AVX2) && !defined(DELAUNAY_INDEX64)
    if (c->simd) {
        delaunay__renumber_avx2(c, t, count, y);
        return;
    }
#  endif
    delaunay__renumber_plain(c, t, count, y);
}

/* Takes the tetrahedron in a slot for moving it ("lifts" it): returns its new slot, from the slot's
 * entry in moved, which becomes leave; 0: none is there to be moved. shared: other threads lift,
 * too; an entry is DELAUNAY__LIFTING while a thread copies the tetrahedron. */
#  define DELAUNAY__LIFTING ((delaunay_handle)-1)
DELAUNAY_INLINE delaunay_handle delaunay__take_slot(delaunay_handle *moved, delaunay_handle leave,
                                                    const int shared)
{
    delaunay_handle to;
    if (!shared) {
        to = *moved;
        *moved = leave;
        return to;
    }
#  if DELAUNAY__PARALLEL
    while ((to = __atomic_load_n(moved, __ATOMIC_ACQUIRE)) != DELAUNAY_NONE)
        if (to != DELAUNAY__LIFTING &&
            __atomic_compare_exchange_n(moved, &to, leave, 0, __ATOMIC_ACQUIRE, __ATOMIC_RELAXED))
            return to;
#  endif
    return DELAUNAY_NONE;
}

/* Every 256th tetrahedron, lifted beforehand, and its new slot; in the spare memory. */
typedef struct delaunay__starts {
    delaunay_tet *tets;
    delaunay_handle *places;
} delaunay__starts;

enum { DELAUNAY__BETWEEN_STARTS = 256 };

static void delaunay__starts_init(delaunay__starts *s, const delaunay__numbering *c)
{
    s->tets = (delaunay_tet *)(void *)c->spare;
    s->places = (delaunay_handle *)(void *)(s->tets + c->mesh->num_tets / DELAUNAY__BETWEEN_STARTS +
                                            1);
}

static void delaunay__lift_starts(const delaunay__numbering *c, const delaunay__starts *s,
                                  size_t from, size_t end)
{
    for (; from < end; from++) {
        size_t t = from * DELAUNAY__BETWEEN_STARTS;
        s->tets[from] = c->mesh->tets[t];
        s->places[from] = c->moved[t] & c->slot_mask;
        c->moved[t] = DELAUNAY_NONE;
    }
}

/* Moves every tetrahedron to its new slot, in place: along the cycles of the permutation, several
 * at a time so that their cache misses overlap. A chain lifts the tetrahedron in one of the slots
 * next to end-1, which leaves a hole. It goes on with the tetrahedron that this one displaces, and
 * so on, until it comes to a hole: its own, that of another chain, or a deleted slot. shared: other
 * threads lift from other slots. Only one chain ever comes to a slot; it and the thread that may
 * lift from there agree by moved. If starts is not NULL, the chains begin with starts next to end-1
 * instead; then no two chains meet. */
DELAUNAY_INLINE void delaunay__move_share(const delaunay__numbering *c, size_t next, size_t end,
                                          const delaunay__starts *starts, const int shared)
{
    enum { DELAUNAY__CHAINS = 64 };
    delaunay_tet *tets = c->mesh->tets, carried[DELAUNAY__CHAINS], x;
    delaunay_handle target[DELAUNAY__CHAINS], *moved = c->moved, to;
    int i, busy = 1;
    memset(target, 0, sizeof target);
    while (busy) {
        busy = 0;
        for (i = 0; i < DELAUNAY__CHAINS; i++) {
            delaunay_handle t = target[i];
            if (t) {
                to = delaunay__take_slot(&moved[t], DELAUNAY_NONE, shared);
                x = tets[t];
                tets[t] = carried[i];
            } else if (starts) {
                if (next == end) continue;
                x = starts->tets[next];
                to = starts->places[next++];
            } else {
                while (next < end && !DELAUNAY__LOAD(&moved[next])) next++;
                if (next == end) continue;
                to = delaunay__take_slot(&moved[next], DELAUNAY__LIFTING, shared);
                x = tets[next];
#  if DELAUNAY__PARALLEL
                if (to) __atomic_store_n(&moved[next], DELAUNAY_NONE, __ATOMIC_RELEASE);
#  else
                moved[next] = DELAUNAY_NONE;
#  endif
            }
            to &= c->slot_mask;
            carried[i] = x;
            target[i] = to;
            busy = 1;
            DELAUNAY__PREFETCH(&tets[to]);
            DELAUNAY__PREFETCH(&moved[to]);
        }
    }
}

/* A queue, in the spare memory, of the tetrahedra that the sweep (delaunay__sweep_tets) has lifted
 * and whose new slots it has not reached yet. */
typedef struct delaunay__lifted {
    delaunay_tet *ring;
    size_t cap, head, count;
    size_t oldest; /* the slot from which the first one was lifted */
} delaunay__lifted;

enum { DELAUNAY__SWEEP = 64 }; /* slots at a time, from a multiple of this number on */

/* The new slot of the first one in the queue. */
static size_t delaunay__lifted_place(const delaunay__numbering *c, const delaunay__lifted *l)
{
    return c->moved[l->oldest] & c->slot_mask;
}

/* Removes the first one. The next in the queue is from the next slot whose tetrahedron has a new
 * slot beyond its own step of the sweep, and has not been placed already. */
static void delaunay__lifted_pop(const delaunay__numbering *c, delaunay__lifted *l)
{
    size_t s = l->oldest;
    l->head = l->head + 1 == l->cap ? 0 : l->head + 1;
    if (--l->count == 0) return;
    do s++;
    while ((c->moved[s] & c->slot_mask) <= (s | (DELAUNAY__SWEEP - 1)) ||
           c->mesh->mark[s] >= DELAUNAY__PLACED);
    l->oldest = s;
}

/* Puts x, which was in slot t, into its new slot at once, for want of room in the queue, though the
 * sweep has not reached it: the tetrahedron there goes to its own new slot, and so on to a free
 * one. */
static DELAUNAY__NOINLINE void delaunay__place_chain(const delaunay__numbering *c, size_t t,
                                                     delaunay_tet x, size_t swept)
{
    uint8_t *mark = c->mesh->mark;
    size_t to = c->moved[t] & c->slot_mask;
    mark[t] = (uint8_t)(mark[t] + DELAUNAY__PLACED);
    while (to >= swept && mark[to]) {
        delaunay_tet y;
        delaunay__renumber(c, to, 1, &y);
        mark[to] = (uint8_t)(mark[to] + DELAUNAY__PLACED);
        c->mesh->tets[to] = x;
        x = y;
        to = c->moved[to] & c->slot_mask;
    }
    c->mesh->tets[to] = x;
}

static void delaunay__lift(const delaunay__numbering *c, delaunay__lifted *l, size_t t,
                           const delaunay_tet *x, size_t swept)
{
    size_t end = l->head + l->count;
    if (l->count == l->cap) {
        delaunay__place_chain(c, t, *x, swept);
        return;
    }
    if (l->count++ == 0) l->oldest = t;
    l->ring[end < l->cap ? end : end - l->cap] = *x;
}

/* Renumbers and moves all tetrahedra in one sweep over the slots: down to a slot that is swept,
 * else to the queue. Those that one thread made along the curve are nearly in order and go down,
 * except for those in slots of the round before, an eighth of all: these fit into the queue. */
static DELAUNAY__NOINLINE void delaunay__sweep_tets(const delaunay__numbering *c)
{
    delaunay_tet *tets = c->mesh->tets, x[DELAUNAY__SWEEP];
    const uint8_t *mark = c->mesh->mark;
    size_t from, end, t, slots = c->mesh->num_tets;
    delaunay__lifted l;
    memset(&l, 0, sizeof l);
    l.ring = (delaunay_tet *)(void *)c->spare;
    l.cap = c->cap_spare * sizeof *c->spare / sizeof *l.ring;
    for (from = 0; from < slots; from = end) {
        end = slots - from < DELAUNAY__SWEEP ? slots : from + DELAUNAY__SWEEP;
        delaunay__renumber(c, from, end - from, x);
        for (t = from; t < end; t++) {
            size_t to = c->moved[t] & c->slot_mask, ahead = t + DELAUNAY__SWEEP;
            DELAUNAY__PREFETCH_WRITE(&tets[c->moved[ahead < slots ? ahead : t] & c->slot_mask]);
            if (mark[t] == 0 || mark[t] >= DELAUNAY__PLACED) continue;
            if (to < end) tets[to] = x[t - from];
            else delaunay__lift(c, &l, t, &x[t - from], end);
        }
        while (l.count && (t = delaunay__lifted_place(c, &l)) < end) {
            tets[t] = l.ring[l.head];
            delaunay__lifted_pop(c, &l);
        }
    }
}

/* Whether so few tetrahedra go up that the queue of a sweep has room for nearly all that wait at
 * the same time; judged by every 61st slot. */
static int delaunay__is_nearly_in_order(const delaunay__numbering *c)
{
    enum { DELAUNAY__STEP = 61 };
    size_t t, slots = c->mesh->num_tets, up = 0; /* deleted ones go to 0 */
    for (t = 1; t < slots; t += DELAUNAY__STEP)
        up += (c->moved[t] & c->slot_mask) > (t | (DELAUNAY__SWEEP - 1));
    return DELAUNAY__STEP * up <= slots / 4;
}

/* Renumbers and moves all with several threads. Each renumbers the tetrahedra in its own slots in
 * place, reading moved and mark. Then chains from the starts move nearly all of them, without any
 * communication between threads; what remains are cycles and ends of chains without a start. */
static DELAUNAY__NOINLINE void delaunay__move_shared(const delaunay__numbering *c)
{
    delaunay__starts starts;
    int i, pass;
    delaunay__starts_init(&starts, c);
    for (pass = 0; pass < 4; pass++) {
        DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static, 1))
        for (i = 0; i < c->threads; i++) {
            size_t from, end, first, last;
            delaunay__slots_of(c, i, &from, &end);
            first = (from - 1) / DELAUNAY__BETWEEN_STARTS + 1; /* not before from */
            last = (end - 1) / DELAUNAY__BETWEEN_STARTS + 1;
            if (pass == 0) delaunay__renumber(c, from, end - from, c->mesh->tets + from);
            else if (pass == 1) delaunay__lift_starts(c, &starts, first, last);
            else if (pass == 2) delaunay__move_share(c, first, last, &starts, 0);
            else delaunay__move_share(c, from, end, NULL, 1);
        }
    }
}

/* Renumbers and moves all tetrahedra. */
static DELAUNAY__NOINLINE void delaunay__move_tets(const delaunay__numbering *c)
{
    size_t slots = c->mesh->num_tets;
    if (c->threads > 1) {
        delaunay__move_shared(c);
    } else if (delaunay__is_nearly_in_order(c)) {
        delaunay__sweep_tets(c);
    } else {
        delaunay__renumber(c, 1, slots - 1, c->mesh->tets + 1);
        delaunay__move_share(c, 1, slots, NULL, 0);
    }
    memset(c->mesh->mark, 0, slots);
}

/* Moves flags and colours to new arrays, which replace the old ones. No two slots have the same new
 * slot, so the threads write different entries. */
static void delaunay__move_marks(const delaunay__numbering *c, uint16_t *flags, uint32_t *color)
{
    delaunay_mesh *mesh = c->mesh;
    const int64_t num = (int64_t)mesh->num_tets;
    int64_t t;
    if (flags) {
        DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static) if(c->threads > 1))
        for (t = 1; t < num; t++)
            if (mesh->mark[t]) flags[c->moved[t] & c->slot_mask] = mesh->flags[t];
        delaunay_release(&mesh->memory, mesh->flags);
        mesh->flags = flags;
    }
    if (color) {
        DELAUNAY__OMP(omp parallel for num_threads(c->threads) schedule(static) if(c->threads > 1))
        for (t = 1; t < num; t++)
            if (mesh->mark[t]) color[c->moved[t] & c->slot_mask] = mesh->color[t];
        delaunay_release(&mesh->memory, mesh->color);
        mesh->color = color;
    }
}

/* Allocates the memory of a numbering; 0: out of memory. */
static int delaunay__numbering_init(delaunay__numbering *c, delaunay_mesh *mesh,
                                    const delaunay_host *host)
{
    delaunay_memory *m = &mesh->memory;
    size_t slots = mesh->num_tets, num_counts;
    memset(c, 0, sizeof *c);
    c->mesh = mesh;
    c->threads = slots < 100000 ? 1 : delaunay_threads(host);
    c->slot_mask = (delaunay_handle)-1;
#  if defined(DELAUNAY__AVX2) && !defined(DELAUNAY_INDEX64)
    c->simd = DELAUNAY__AVX2 && slots < (size_t)1 << DELAUNAY__PACKED_BITS;
    if (c->simd) c->slot_mask = ((delaunay_handle)1 << DELAUNAY__PACKED_BITS) - 1;
#  endif
    num_counts = 2 * (size_t)c->threads;
    c->num_chunks = (mesh->num_vertices - 1) / DELAUNAY__CHUNK + 1;
    c->cap_spare = slots + mesh->num_vertices;
    c->moved = (delaunay_handle *)delaunay_alloc(m, slots, sizeof *c->moved);
    c->spare = (delaunay_handle *)delaunay_alloc(m, c->cap_spare, sizeof *c->spare);
    c->counts = (size_t *)delaunay_alloc(m, c->num_chunks, num_counts * sizeof *c->counts);
    c->large = (delaunay__large_bucket *)delaunay_alloc(m, slots / DELAUNAY__MANY_TETS + 1,
                                                        sizeof *c->large);
    c->owner = (uint16_t *)delaunay_alloc(m, c->num_chunks, sizeof *c->owner);
    c->others = (delaunay_handle *)delaunay_alloc(m, (size_t)c->threads, sizeof *c->others);
    if (!c->moved || !c->spare || !c->counts || !c->large || !c->owner || !c->others) return 0;
    c->keys = (uint32_t *)(void *)c->spare;
    c->heads = c->spare + slots;
    memset(c->heads, 0, mesh->num_vertices * sizeof *c->heads);
    memset(c->counts, 0, c->num_chunks * num_counts * sizeof *c->counts);
    delaunay__rotations_init(&c->rotations);
    return 1;
}

static void delaunay__numbering_free(delaunay__numbering *c)
{
    delaunay_memory *m = &c->mesh->memory;
    delaunay_release(m, c->moved);
    delaunay_release(m, c->spare);
    delaunay_release(m, c->counts);
    delaunay_release(m, c->large);
    delaunay_release(m, c->owner);
    delaunay_release(m, c->others);
}

/* Finds the new slot of every tetrahedron. Returns the end of the new slots, 0 if out of memory. */
static size_t delaunay__find_places(delaunay__numbering *c)
{
    size_t end;
    c->moved[0] = 0;
    delaunay__find_rotations(c);
    end = delaunay__add_up(c);
    delaunay__drop_deleted(c);
    delaunay__sort_buckets(c, 0);
    delaunay__list_ghosts(c);
    delaunay__sort_buckets(c, 1);
    return delaunay__sort_large_buckets(c) ? end : 0;
}

/* Sets a vertex's tetrahedron to t, unless it is a lower slot; other threads may do the same. */
DELAUNAY_INLINE void delaunay__lower(delaunay_handle *tet, delaunay_handle t)
{
    delaunay_handle was = DELAUNAY__LOAD(tet);
#  if DELAUNAY__PARALLEL
    while ((was == 0 || was > t) &&
           !__atomic_compare_exchange_n(tet, &was, t, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#  else
    if (was == 0 || was > t) *tet = t;
#  endif
}

/* Sets vertex_tet to the lowest slot of each vertex's star. No slot of the mesh is deleted. */
static void delaunay__link_lowest(delaunay_mesh *mesh, int threads)
{
    const int64_t num = (int64_t)mesh->num_tets;
    int64_t t;
    int i;
    (void)threads;
    memset(mesh->vertex_tet, 0, mesh->cap_vertices * sizeof *mesh->vertex_tet);
    DELAUNAY__OMP(omp parallel for num_threads(threads) schedule(static) private(i) if(threads > 1))
    for (t = 1; t < num; t++)
        for (i = 0; i < 4; i++)
            delaunay__lower(&mesh->vertex_tet[mesh->tets[t].v[i]], (delaunay_handle)t);
}

DELAUNAY_API delaunay_result delaunay_canonicalize(delaunay_mesh *mesh, const delaunay_host *host)
{
    delaunay_memory *m = &mesh->memory;
    delaunay__numbering c;
    uint16_t *flags = NULL;
    uint32_t *color = NULL;
    size_t end;
    delaunay_result result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    if (mesh->num_tets == 0 || mesh->num_vertices == 0) return DELAUNAY_OK;
    if (!delaunay__numbering_init(&c, mesh, host)) goto done;
    if (mesh->flags &&
        !(flags = (uint16_t *)delaunay_alloc_zeroed(m, mesh->cap_tets, sizeof *flags)))
        goto done;
    if (mesh->color &&
        !(color = (uint32_t *)delaunay_alloc_zeroed(m, mesh->cap_tets, sizeof *color)))
        goto done;
    end = delaunay__find_places(&c);
    if (!end) {
        memset(mesh->mark, 0, mesh->num_tets);
        goto done;
    }
    /* nothing can fail from here on */
    delaunay__move_marks(&c, flags, color);
    flags = NULL;
    color = NULL;
    delaunay__move_tets(&c);
    mesh->num_tets = (delaunay_handle)end;
    mesh->num_free = 0;
    if (mesh->vertex_tet) delaunay__link_lowest(mesh, c.threads);
    result = DELAUNAY_OK;
done:
    delaunay__numbering_free(&c);
    delaunay_release(m, flags);
    delaunay_release(m, color);
    return result;
}

/* ---- >>import  a mesh from arrays --------------------------------------------------------- */

static delaunay_result delaunay__say(delaunay_report *report, delaunay_result result,
                                     const char *message)
{
    if (report) snprintf(report->message, sizeof report->message, "%s", message);
    return result;
}

/* Adds to the message which tetrahedron it is, and where its first corner is. */
static void delaunay__say_tet(delaunay_report *report, const double *xyz, size_t num_points,
                              const uint32_t *tets, uint32_t t)
{
    const size_t length = strlen(report->message);
    const uint32_t *v = tets + 4 * (size_t)t;
    if (v[0] < num_points) memcpy(report->xyz, xyz + 3 * (size_t)v[0], sizeof report->xyz);
    snprintf(report->message + length, sizeof report->message - length,
             ": tetrahedron %lu (%lu, %lu, %lu, %lu), at (%.9g, %.9g, %.9g)", (unsigned long)t,
             (unsigned long)v[0], (unsigned long)v[1], (unsigned long)v[2], (unsigned long)v[3],
             report->xyz[0], report->xyz[1], report->xyz[2]);
}

static int delaunay__is_finite(const double *x)
{
    return x[0] - x[0] == 0 && x[1] - x[1] == 0 && x[2] - x[2] == 0;
}

/* Whether all of some numbers are finite. */
static int delaunay__are_finite(const double *x, size_t count, int threads)
{
    const int64_t n = (int64_t)count;
    int64_t i;
    int odd = 0;
    (void)threads;
    DELAUNAY__OMP(omp parallel for schedule(static) num_threads(threads) reduction(| : odd) \
                  if(threads > 1))
    for (i = 0; i < n; i++) odd |= !(x[i] - x[i] == 0);
    return !odd;
}

/* Reports up to four points with a coordinate that is not finite; first: the id of the first point.
 */
static delaunay_result delaunay__check_finite(const double *xyz, size_t count, uint32_t first,
                                              const delaunay_host *host, delaunay_report *report)
{
    size_t i;
    if (delaunay__are_finite(xyz, 3 * count, delaunay_threads_for(host, count)))
        return DELAUNAY_OK;
    for (i = 0; i < count && report->num_ids < 4; i++) {
        const double *x = xyz + 3 * i;
        if (delaunay__is_finite(x)) continue;
        if (report->num_ids == 0) memcpy(report->xyz, x, sizeof report->xyz);
        report->ids[report->num_ids++] = first + (uint32_t)i;
    }
    if (!report->num_ids) return DELAUNAY_OK;
    snprintf(report->message, sizeof report->message,
             "point %lu at (%.9g, %.9g, %.9g): a coordinate is not finite",
             (unsigned long)report->ids[0], report->xyz[0], report->xyz[1], report->xyz[2]);
    return DELAUNAY_ERROR_NOT_FINITE;
}

static uint32_t delaunay__facet_hash(const uint32_t *v)
{
    uint32_t a = v[0], b = v[1], c = v[2];
    return (a + b + c) * 0x9e3779b1u ^ (a ^ b ^ c) * 0x85ebca6bu;
}

/* 0: different vertices; 1: the same in the same cyclic order; -1: in the opposite one. */
static int delaunay__same_facet(const uint32_t *a, const uint32_t *b)
{
    int i;
    for (i = 0; i < 3; i++)
        if (a[0] == b[i]) {
            uint32_t next = b[(i + 1) % 3], last = b[(i + 2) % 3];
            return a[1] == next && a[2] == last ? 1 : a[2] == next && a[1] == last ? -1 : 0;
        }
    return 0;
}

static void delaunay__get_facet(const delaunay_mesh *mesh, delaunay_handle f, uint32_t *v)
{
    int i;
    for (i = 0; i < 3; i++) v[i] = mesh->tets[f >> 2].v[delaunay_facet_vertices[f & 3][i]];
}

/* Links every two tetrahedra that share a facet. A third one there is an error, and so are two on
 * the same side. */
static delaunay_result delaunay__link_tets(delaunay_mesh *mesh, delaunay_report *report)
{
    size_t mask = 255, i;
    delaunay_handle *table, t, f;
    delaunay_result result = DELAUNAY_OK;
    while (mask < 6 * (size_t)mesh->num_tets) mask = 2 * mask + 1;
    table = (delaunay_handle *)delaunay_alloc_zeroed(&mesh->memory, mask + 1, sizeof *table);
    if (!table) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    for (t = 1; t < mesh->num_tets && result == DELAUNAY_OK; t++)
        for (f = 4 * t; f < 4 * t + 4; f++) {
            uint32_t v[3], w[3];
            uint32_t h;
            int turn = 0;
            delaunay__get_facet(mesh, f, v);
            h = delaunay__facet_hash(v);
            for (i = (h ^ h >> 15) & mask; table[i]; i = (i + 1) & mask) {
                delaunay__get_facet(mesh, table[i], w);
                if ((turn = delaunay__same_facet(v, w)) != 0) break;
            }
            if (!table[i]) {
                table[i] = f;
            } else if (mesh->tets[table[i] >> 2].n[table[i] & 3]) {
                result = delaunay__say(report, DELAUNAY_ERROR_INVALID_MESH,
                                       "three tetrahedra share a facet");
            } else if (turn > 0) {
                result = delaunay__say(report, DELAUNAY_ERROR_INVALID_MESH,
                                       "two tetrahedra are on the same side of a facet");
            } else {
                mesh->tets[t].n[f & 3] = table[i];
                mesh->tets[table[i] >> 2].n[table[i] & 3] = f;
            }
            if (result != DELAUNAY_OK) {
                if (report) report->ids[0] = (uint32_t)(t - 1), report->num_ids = 1;
                break;
            }
        }
    delaunay_release(&mesh->memory, table);
    return result;
}

/* Makes t, positive, of four of the caller's points, which the mesh has already. The first
 * tetrahedron decides whether all must be reversed (*turn). */
static delaunay_result delaunay__import_tet(const delaunay_mesh *mesh, delaunay_tet *t,
                                            const uint32_t *points, int *turn,
                                            delaunay_report *report)
{
    int j, sign;
    memset((void *)t, 0, sizeof *t);
    for (j = 0; j < 4; j++) {
        if (points[j] >= mesh->num_points)
            return delaunay__say(report, DELAUNAY_ERROR_INVALID_ARGUMENT,
                                 "a tetrahedron names a point that is not there");
        t->v[j] = points[j] + 1;
    }
    sign = delaunay_orient3d(mesh->vertices[t->v[0]].x, mesh->vertices[t->v[1]].x,
                             mesh->vertices[t->v[2]].x, mesh->vertices[t->v[3]].x);
    if (t == mesh->tets + 1) *turn = sign < 0;
    if (*turn ? sign >= 0 : sign <= 0)
        return delaunay__say(report, DELAUNAY_ERROR_INVALID_MESH,
                             sign ? "tetrahedra of both orientations" : "a flat tetrahedron");
    if (*turn) {
        uint32_t v = t->v[2];
        t->v[2] = t->v[3];
        t->v[3] = v;
    }
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_import(delaunay_mesh *mesh, const double *xyz,
                                             size_t num_points, const uint32_t *tets,
                                             const uint32_t *colors, size_t num_tets,
                                             const delaunay_host *host, delaunay_report *report)
{
    delaunay_report unused;
    delaunay_result result;
    size_t i;
    int turn = 0;
    if (!report) report = &unused;
    memset(report, 0, sizeof *report);
    report->dimension = num_tets ? 3 : -1;
    if (!mesh || (num_points && !xyz) || (num_tets && !tets))
        return delaunay__say(report, DELAUNAY_ERROR_INVALID_ARGUMENT, "a null pointer");
    if (num_points >= UINT32_MAX - 16 || num_tets >= (size_t)((delaunay_handle)-1) / 4 - 16)
        return delaunay__say(report, DELAUNAY_ERROR_TOO_LARGE, "too many points or tetrahedra");
    delaunay_mesh_free(mesh);
    result = delaunay_memory_init(&mesh->memory, host);
    if (result == DELAUNAY_OK) result = delaunay__check_finite(xyz, num_points, 0, host, report);
    if (result == DELAUNAY_OK) result = delaunay_reserve(mesh, num_points + 1, num_tets + 1);
    if (result != DELAUNAY_OK) goto done;
    mesh->vertex_of =
        (uint32_t *)delaunay_alloc(&mesh->memory, num_points, sizeof *mesh->vertex_of);
    if (!mesh->vertex_of) {
        result = DELAUNAY_ERROR_OUT_OF_MEMORY;
        goto done;
    }
    if (colors) result = delaunay_enable_marks(mesh);
    if (result != DELAUNAY_OK) goto done;
    mesh->num_points = (uint32_t)num_points;
    for (i = 0; i < num_points; i++)
        mesh->vertex_of[i] = delaunay_add_vertex(mesh, xyz + 3 * i, (uint32_t)i);
    for (i = 0; i < num_tets && result == DELAUNAY_OK; i++) {
        result = delaunay__import_tet(mesh, &mesh->tets[i + 1], tets + 4 * i, &turn, report);
        if (colors) mesh->color[i + 1] = colors[i];
        if (result == DELAUNAY_OK) continue;
        report->ids[0] = (uint32_t)i;
        report->num_ids = 1;
    }
    mesh->num_tets = (delaunay_handle)num_tets + 1;
    if (result == DELAUNAY_OK) result = delaunay__link_tets(mesh, report);
done:
    if (result != DELAUNAY_OK && result != DELAUNAY_ERROR_NOT_FINITE && report->num_ids)
        delaunay__say_tet(report, xyz, num_points, tets, report->ids[0]);
    report->num_points = num_points;
    report->num_vertices = mesh->num_vertices ? mesh->num_vertices - 1 : 0;
    report->num_tets = result == DELAUNAY_OK ? num_tets : 0;
    report->peak_bytes = mesh->memory.peak_bytes;
    if (result != DELAUNAY_OK) {
        if (!report->message[0])
            (void)delaunay__say(report, result, delaunay_result_string(result));
        delaunay_mesh_free(mesh);
    }
    return result;
}

/* ---- >>partitions  engine (a): sections of the Moore curve [Marot 2020, 4.2-4.6] ------------- */
/* A section is an interval of keys on the curve. It owns the tetrahedra all of whose vertices have
 * keys in the interval; the ghost belongs to every section. Sections cannot interfere with each
 * other: a neighbour of a tetrahedron that a section owns shares a facet with it. Of the three
 * vertices of that facet at least two are not the ghost, and their keys are in the section, so no
 * other section can own the neighbour. What a section reads (the tetrahedra that it owns and their
 * neighbours) is therefore written by no other section (each writes only those that it owns). A
 * tetrahedron with vertices in two sections has no owner until the next attempt, which cuts another
 * curve into sections: a bent one that starts elsewhere.
 *
 * All of this holds for any disjoint sets of vertices, also for sets that grow, as long as a vertex
 * joins a set only while it is in no other. So where the result does not depend on which thread
 * inserts which point (a Delaunay triangulation), the items that sections leave over are divided by
 * claims: the curve is cut into many short pieces, cells; a thread claims a cell when it first
 * needs it and soon releases it again. Threads that hold some hundred cells each seldom collide,
 * whereas with sixteen sections of two million points a quarter of the points is near a border. */
enum {
    DELAUNAY__KEY_BITS = 32,
    DELAUNAY__MAX_ATTEMPTS = 8,       /* after these the rest is inserted one by one */
    DELAUNAY__BETWEEN_PROGRESS = 4096
};

/* A section with fewer items does not pay: its thread reads what others have just written. */
#  ifndef DELAUNAY__ITEMS_A_SECTION
#    define DELAUNAY__ITEMS_A_SECTION 6000 /* less: for tests */
#  endif

/* A section in the current attempt, or the share of one thread where cells are claimed. */
typedef struct delaunay__cut {
    size_t begin, end, left; /* range of its items; the left ones are moved to the front of it */
    uint32_t start, length;  /* keys start .. start + length - 1, wrapping around at 2^32 */
    delaunay_handle hint;    /* a tetrahedron that it owns, to start the first walk from */
    delaunay_handle fresh, fresh_end; /* unused slots at the end of the array reserved for it */
} delaunay__cut;

typedef struct delaunay__partitions {
    delaunay_mesh *mesh;
    const delaunay_host *host;
    delaunay_partition *job;
    delaunay__kernel **kernels;
    delaunay__cut *cuts;
    int num_kernels, num_cuts;
    int num_sections; /* the job's, or the number of items if that is less */
    hilbert_box box;
    uint64_t attempt;
    hxtsort_pair32 *items; /* key, vertex */
    hxtsort_options sort;
    delaunay__claims *claims; /* one per kernel, if keys are cell numbers; NULL: sections */
    uint16_t *owner;          /* per cell: which kernel has claimed it, 0: none */
    double done, all, told; /* progress: items done, items in all, the last fraction reported */
    int status;       /* shared by the threads of a region: an error or a cancellation */
} delaunay__partitions;

static void delaunay__end_claims(delaunay__partitions *p)
{
    int i;
    for (i = 0; p->claims && i < p->num_kernels; i++) p->kernels[i]->claims = NULL;
    delaunay_release(&p->mesh->memory, p->claims);
    delaunay_release(&p->mesh->memory, p->owner);
    p->claims = NULL;
    p->owner = NULL;
}

static void delaunay__partitions_free(delaunay__partitions *p)
{
    delaunay_memory *m = &p->mesh->memory;
    int i;
    delaunay__end_claims(p);
    for (i = 0; p->kernels && i < p->num_kernels; i++) {
        if (p->kernels[i]) delaunay__kernel_free(p->kernels[i]);
        delaunay_release(m, p->kernels[i]);
    }
    delaunay_release(m, p->kernels);
    delaunay_release(m, p->cuts);
}

static delaunay_result delaunay__partitions_init(delaunay__partitions *p, delaunay_mesh *mesh,
                                                 delaunay_partition *job, const delaunay_host *host,
                                                 int exact_doubles)
{
    delaunay_memory *m = &mesh->memory;
    delaunay_result result = DELAUNAY_OK;
    int i;
    memset(p, 0, sizeof *p);
    p->mesh = mesh;
    p->host = host;
    p->job = job;
    p->num_kernels = DELAUNAY__PARALLEL ? delaunay_threads(host) : 1;
    p->num_sections = job->num_sections;
    if ((size_t)p->num_sections > job->num_vertices) p->num_sections = (int)job->num_vertices;
    p->num_cuts = p->num_kernels > p->num_sections ? p->num_kernels : p->num_sections;
    p->sort.num_threads = p->num_kernels;
    p->sort.allocator.alloc = delaunay__counted_alloc;
    p->sort.allocator.release = delaunay__counted_release;
    p->sort.allocator.user = m;
    p->kernels =
        (delaunay__kernel **)delaunay_alloc_zeroed(m, (size_t)p->num_kernels, sizeof *p->kernels);
    p->cuts = (delaunay__cut *)delaunay_alloc(m, (size_t)p->num_cuts, sizeof *p->cuts);
    if (!p->kernels || !p->cuts) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < p->num_kernels && result == DELAUNAY_OK; i++) {
        p->kernels[i] = (delaunay__kernel *)delaunay_alloc(
            m, 1, sizeof **p->kernels + 128); /* padding: no cache line is shared by two kernels */
        if (!p->kernels[i]) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        result = delaunay__kernel_init(p->kernels[i], mesh);
        p->kernels[i]->exact_doubles = exact_doubles;
        p->kernels[i]->worker = i;
        p->kernels[i]->reserve = DELAUNAY__SLOTS_AT_ONCE * (size_t)p->num_kernels;
    }
    return result;
}

/* Computes the keys of vertices 0 .. count-1 on the box's curve (the ghost's key is not used). */
static void delaunay__rekey(delaunay__partitions *p, uint32_t count)
{
    enum { DELAUNAY__KEYS = 1024 };
    delaunay_vertex *v = p->mesh->vertices;
    const hilbert_box *box = &p->box;
    int64_t chunk, num = ((int64_t)count + DELAUNAY__KEYS - 1) / DELAUNAY__KEYS;
    DELAUNAY__OMP(omp parallel for num_threads(p->num_kernels) schedule(static))
    for (chunk = 0; chunk < num; chunk++) {
        uint64_t keys[DELAUNAY__KEYS];
        uint32_t i, first = (uint32_t)chunk * DELAUNAY__KEYS, n = count - first;
        if (n > DELAUNAY__KEYS) n = DELAUNAY__KEYS;
        (void)hilbert_keys3(keys, v[first].x, sizeof *v, n, box, 1);
        for (i = 0; i < n; i++) v[first + i].key = (uint32_t)(keys[i] >> (63 - DELAUNAY__KEY_BITS));
    }
}

/* Chooses another curve for another attempt, and sorts the items along it. A fixed sequence of
 * pseudo-random numbers decides how it is bent and where it starts. */
static delaunay_result delaunay__next_curve(delaunay__partitions *p, uint32_t count,
                                            size_t num_items)
{
    uint64_t h = delaunay__mix(++p->attempt * UINT64_C(0x9e3779b97f4a7c15));
    size_t i;
    int k;
    for (k = 0; k < 3; k++, h >>= 8) p->box.middle[k] = 0.35 + 0.3 * (double)(h & 255) / 255;
    p->box.shift = h << 21 & ((UINT64_C(1) << 63) - 1);
    delaunay__rekey(p, count);
    for (i = 0; i < num_items; i++) p->items[i].key = p->mesh->vertices[p->items[i].value].key;
    return (delaunay_result)hxtsort_pairs32(p->items, num_items, &p->sort);
}

static void delaunay__reverse_items(hxtsort_pair32 *items, size_t begin, size_t end)
{
    while (begin + 1 < end) {
        hxtsort_pair32 x = items[begin];
        items[begin++] = items[--end];
        items[end] = x;
    }
}

/* Rotates the array of items to the left by so many places. */
static void delaunay__turn_items(hxtsort_pair32 *items, size_t num, size_t by)
{
    delaunay__reverse_items(items, 0, by);
    delaunay__reverse_items(items, by, num);
    delaunay__reverse_items(items, 0, num);
}

/* Cuts the items into sections of about equal size; items with equal keys share a section. */
static void delaunay__cut_sections(delaunay__partitions *p, size_t num_items, int num)
{
    int i;
    for (i = 0; i < num; i++) {
        size_t b = num_items * (size_t)i / (size_t)num;
        while (b > 0 && i > 0 && p->items[b - 1].key == p->items[b].key) b--;
        p->cuts[i].begin = b;
        p->cuts[i].start = p->items[b].key;
    }
    for (i = 0; i < num; i++) {
        p->cuts[i].end = i + 1 < num ? p->cuts[i + 1].begin : num_items;
        p->cuts[i].length = p->cuts[(i + 1) % num].start - p->cuts[i].start;
        p->cuts[i].left = p->cuts[i].fresh = p->cuts[i].fresh_end = 0;
    }
}

/* Reserves for each section slots at the end of the array, in the order of the curve: six for each
 * item. (A point ends up with 6.77 tetrahedra, but some items are left over.) So no two threads
 * write to the same new page, which both would have to wait for while the system clears it, and the
 * slots are nearly in canonical order. Not for weighted meshes: hidden points need no slots. */
static void delaunay__deal_fresh(delaunay__partitions *p, size_t num_items, int num)
{
    enum { DELAUNAY__SLOTS_AN_ITEM = 6 };
    delaunay_mesh *mesh = p->mesh;
    size_t first = mesh->num_tets, end = first + DELAUNAY__SLOTS_AN_ITEM * num_items;
    int i;
    if (mesh->weight || end + 2 * p->kernels[0]->reserve > mesh->cap_tets) return;
    for (i = 0; i < num; i++) {
        delaunay__cut *c = &p->cuts[i];
        c->fresh = (delaunay_handle)(first + DELAUNAY__SLOTS_AN_ITEM * c->begin);
        c->fresh_end = (delaunay_handle)(first + DELAUNAY__SLOTS_AN_ITEM * c->end);
    }
    mesh->num_tets = (delaunay_handle)end;
}

/* Takes back the reserved slots that were not used. Those at the end of the array are cut off; the
 * first kernel, which will insert the items left over, gets the others as free slots. */
static delaunay_result delaunay__collect_fresh(delaunay__partitions *p, int num)
{
    delaunay_mesh *mesh = p->mesh;
    delaunay__kernel *k = p->kernels[0];
    int i;
    for (i = num; i-- > 0;) {
        const delaunay__cut *c = &p->cuts[i];
        size_t count = c->fresh_end - c->fresh;
        if (count && c->fresh_end == mesh->num_tets) {
            mesh->num_tets = c->fresh;
            continue;
        }
        if (delaunay__kernel_reserve_freed(k, k->num_freed + count) != DELAUNAY_OK)
            return DELAUNAY_ERROR_OUT_OF_MEMORY;
        k->fresh = c->fresh;
        k->fresh_end = c->fresh_end;
        delaunay__free_fresh(k, count);
    }
    return DELAUNAY_OK;
}

/* A tetrahedron that is not deleted: the hint, if that will do, else the first one, or none. */
static delaunay_handle delaunay__any_tet(const delaunay_mesh *mesh, delaunay_handle hint)
{
    delaunay_handle t;
    if (hint && hint < mesh->num_tets && !delaunay_is_deleted(mesh, hint)) return hint;
    for (t = 1; t < mesh->num_tets; t++)
        if (!delaunay_is_deleted(mesh, t)) return t;
    return DELAUNAY_NONE;
}

/* Finds for each section a tetrahedron that it owns, by walks to some of its items. Without one,
 * all items of the section are left over. */
static void delaunay__place_hints(delaunay__partitions *p, int num)
{
    delaunay__kernel *k = p->kernels[0];
    delaunay_handle t = delaunay__any_tet(p->mesh, k->hint);
    int i, j;
    for (i = 0; i < num; i++) {
        delaunay__cut *c = &p->cuts[i];
        delaunay__kernel *owner = p->claims ? p->kernels[i] : k;
        size_t count = c->end - c->begin;
        c->hint = DELAUNAY_NONE;
        owner->start = c->start;
        owner->length = c->length;
        for (j = 1; j < 16 && count > 0 && c->hint == DELAUNAY_NONE; j++) {
            const double *e =
                p->mesh->vertices[p->items[c->begin + count * (size_t)(j * 5 % 16) / 16].value].x;
            if (k->tets[t].v[3] == DELAUNAY_GHOST) t = k->tets[t].n[3] >> 2;
            t = delaunay__walk_fast(k, t, e);
            if (!delaunay__is_foreign_tet(owner, t)) c->hint = t;
            if (p->claims) delaunay__let_go(owner, c->hint);
        }
    }
}

static int delaunay__edit(const delaunay__partitions *p, delaunay__kernel *k, uint32_t v)
{
    if (p->job->edit) return p->job->edit(p->job->user, k, v);
    return delaunay_section_insert(k, v);
}

/* Reports progress to the host, done being an estimate of the items finished in this attempt, and
 * returns nonzero if the host cancels. Called by the calling thread only. */
static int delaunay__cancelled(delaunay__partitions *p, double done)
{
    double fraction = p->all > 0 ? (p->done + done) / p->all : 0;
    if (!p->host || !p->host->progress) return 0;
    if (fraction > p->told) p->told = fraction < 1 ? fraction : 1;
    return p->host->progress(p->host->user, p->job->phase ? p->job->phase : "insert", p->told);
}

/* Calls the edit for the items of a section, and moves those left over to the front. Gives up if
 * after an eighth of the items more than 19 of 20 were in conflict: then the sections of this curve
 * are of no use, as for points on a sphere, where a cavity can reach everywhere. */
static void delaunay__pass(delaunay__partitions *p, delaunay__kernel *k, delaunay__cut *c,
                           int is_caller, int num)
{
    size_t i, left = 0;
    int hopeless = c->hint == DELAUNAY_NONE;
    for (i = c->begin; i < c->end; i++) {
        int answer = DELAUNAY_ITEM_CONFLICT;
        if (i % DELAUNAY__BETWEEN_PROGRESS == 0) {
            if (is_caller && delaunay__cancelled(p, (double)(i - c->begin) * num))
                DELAUNAY__STORE(&p->status, DELAUNAY_CANCELLED);
            hopeless |= DELAUNAY__LOAD(&p->status) != DELAUNAY_OK;
        }
        if (!hopeless) answer = delaunay__edit(p, k, p->items[i].value);
        if (answer < 0) {
            DELAUNAY__STORE(&p->status, answer);
            hopeless = 1;
        }
        if (answer == DELAUNAY_ITEM_CONFLICT) p->items[c->begin + left++] = p->items[i];
        if (k->claims && (answer == DELAUNAY_ITEM_CONFLICT || k->claims->num > k->claims->enough))
            delaunay__let_go(k, k->hint);
        if (i - c->begin == (c->end - c->begin) / 8) hopeless |= 20 * left > 19 * (i - c->begin);
    }
    if (k->claims) delaunay__let_go(k, DELAUNAY_NONE);
    c->left = left;
}

/* Processes one section in one thread; only the calling thread talks to the host. */
static void delaunay__work(delaunay__partitions *p, delaunay__kernel *k, delaunay__cut *c,
                           int is_caller, int num)
{
    k->start = c->start;
    k->length = c->length;
    k->hint = c->hint;
    k->fresh = c->fresh;
    k->fresh_end = c->fresh_end;
    delaunay__pass(p, k, c, is_caller, num);
    c->fresh = k->fresh;
    c->fresh_end = k->fresh_end;
    k->fresh = k->fresh_end = 0;
}

/* Shared by the threads: the mesh (each section writes only tetrahedra that it owns, see above;
 * keys and coordinates are only read; the slot counter is atomic) and status. Divided among them:
 * items and cuts. Private: the kernels. */
static void delaunay__run_sections(delaunay__partitions *p, int num)
{
    int i, threads = p->num_kernels < num ? p->num_kernels : num;
    (void)threads;
    for (i = 0; i < p->num_kernels; i++) p->kernels[i]->parallel = 1;
#  if DELAUNAY__PARALLEL
#    pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (i = 0; i < num; i++) {
        int thread = omp_get_thread_num();
        delaunay__work(p, p->kernels[p->claims ? i : thread], &p->cuts[i], thread == 0, num);
    }
#  else
    for (i = 0; i < num; i++) delaunay__work(p, p->kernels[0], &p->cuts[i], 1, num);
#  endif
    for (i = 0; i < p->num_kernels; i++) { p->kernels[i]->parallel = 0; }
}

/* Before a region: enlarges the buffers that were too small in the last one, and reserves slots. A
 * failure is ignored here: it occurs again in the serial run at the end, which reports it. */
static void delaunay__feed_kernels(delaunay__partitions *p, size_t num_items)
{
    size_t slots = p->mesh->num_tets + 7 * num_items + p->kernels[0]->reserve;
    int i;
    for (i = 0; i < p->num_kernels; i++) {
        delaunay__kernel *k = p->kernels[i];
        (void)delaunay__kernel_reserve_freed(k, k->num_freed + 8192);
        if (!k->needs_memory) continue;
        k->needs_memory = 0;
        if (k->needs_slots && slots < p->mesh->cap_tets + (size_t)p->mesh->cap_tets / 2)
            slots = p->mesh->cap_tets + (size_t)p->mesh->cap_tets / 2;
        k->needs_slots = 0;
        (void)delaunay__kernel_grow_search(k);
        (void)delaunay__kernel_reserve_freed(k, 2 * k->cap_freed);
    }
    (void)delaunay__reserve_tets(p->mesh, slots);
}

static int delaunay__run_serial(delaunay__partitions *p, size_t num_items)
{
    delaunay__kernel *k = p->kernels[0];
    size_t i;
    delaunay__kernel_view(k);
    k->hint = delaunay__any_tet(p->mesh, k->hint);
    k->length = 0;
    for (i = 0; i < num_items; i++) {
        int answer;
        if (i % DELAUNAY__BETWEEN_PROGRESS == 0 && delaunay__cancelled(p, (double)i))
            return DELAUNAY_CANCELLED;
        answer = delaunay__edit(p, k, p->items[i].value);
        if (answer < 0) return answer;
        if (answer == DELAUNAY_ITEM_CONFLICT)
            return DELAUNAY_ERROR_INTERNAL; /* no other thread is there to conflict with */
    }
    p->done += (double)num_items;
    return DELAUNAY_OK;
}

/* One attempt in num sections; deal: reserve slots for each of them. Returns the number of items
 * left over, which are moved to the front, or an error. */
static int64_t delaunay__attempt(delaunay__partitions *p, size_t num_items, int num, int deal)
{
    size_t left = 0;
    int i;
    delaunay__feed_kernels(p, num_items);
    for (i = 0; i < p->num_kernels; i++) delaunay__kernel_view(p->kernels[i]);
    delaunay__cut_sections(p, num_items, num);
    delaunay__place_hints(p, num);
    if (deal) delaunay__deal_fresh(p, num_items, num);
    delaunay__run_sections(p, num);
    if (deal && delaunay__collect_fresh(p, num) != DELAUNAY_OK) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    if (p->status != DELAUNAY_OK) return p->status;
    for (i = 0; i < num; i++) {
        memmove(p->items + left, p->items + p->cuts[i].begin, p->cuts[i].left * sizeof *p->items);
        left += p->cuts[i].left;
    }
    p->job->attempts++;
    p->job->conflicts += left;
    p->done += (double)(num_items - left);
    return (int64_t)left;
}

/* Inserts the items in attempts with ever fewer sections, then the rest one by one. fresh: vertices
 * 1 .. count-1 have keys and the items are sorted by them, so the first attempt uses this curve;
 * otherwise, and for the other attempts, a new one is computed. */
static int delaunay__run_items(delaunay__partitions *p, uint32_t count, size_t num_items, int fresh)
{
    int num = p->num_sections ? p->num_sections : p->num_kernels, attempt, result = DELAUNAY_OK;
    for (attempt = 0; attempt < DELAUNAY__MAX_ATTEMPTS; attempt++) {
        int64_t left;
        if ((size_t)num > num_items / DELAUNAY__ITEMS_A_SECTION)
            num = (int)(num_items / DELAUNAY__ITEMS_A_SECTION);
        if (num <= 1) break;
        if (attempt > 0 || !fresh) result = delaunay__next_curve(p, count, num_items);
        if (result != DELAUNAY_OK) return result;
        left = delaunay__attempt(p, num_items, num, 0);
        if (left < 0) return (int)left;
        if (2 * (size_t)left > num_items) num /= 2;
        num_items = (size_t)left;
    }
    return delaunay__run_serial(p, num_items);
}

/* Replaces the keys of vertices 0 .. count-1 by the numbers of their cells; cell c begins with key
 * first[c]. As most vertices follow the curve, the search starts at the cell of the vertex before,
 * with doubling steps. */
static void delaunay__number_cells(delaunay__partitions *p, uint32_t count, const uint32_t *first,
                                   uint32_t num_cells)
{
    enum { DELAUNAY__VERTICES = 1024 };
    delaunay_vertex *v = p->mesh->vertices;
    int64_t chunk, num = ((int64_t)count + DELAUNAY__VERTICES - 1) / DELAUNAY__VERTICES;
    DELAUNAY__OMP(omp parallel for num_threads(p->num_kernels) schedule(static))
    for (chunk = 0; chunk < num; chunk++) {
        uint32_t i = (uint32_t)chunk * DELAUNAY__VERTICES, cell = 0,
                 end = count - i < DELAUNAY__VERTICES ? count : i + DELAUNAY__VERTICES;
        for (; i < end; i++) {
            uint32_t step = 1;
            if (v[i].key < first[cell]) cell = 0;
            while (cell + step < num_cells && first[cell + step] <= v[i].key)
                cell += step, step *= 2;
            for (; step; step /= 2)
                if (cell + step < num_cells && first[cell + step] <= v[i].key) cell += step;
            v[i].key = cell;
        }
    }
}

/* Replaces the keys of vertices 1 .. count-1 by cell numbers. Vertices from begin on, which are in
 * the order of their keys, define the cells: 64 of them make one. The others get the cell that
 * their key falls into. */
static delaunay_result delaunay__begin_claims(delaunay__partitions *p, uint32_t begin,
                                              uint32_t count)
{
    enum { DELAUNAY__ROUND_A_CELL = 64, DELAUNAY__ENOUGH = 128 };
    delaunay_memory *m = &p->mesh->memory;
    const uint32_t num_cells = (count - begin) / DELAUNAY__ROUND_A_CELL + 1;
    uint32_t *first = (uint32_t *)delaunay_alloc(m, num_cells, sizeof *first), j;
    int i;
    p->owner = (uint16_t *)delaunay_alloc(m, num_cells, sizeof *p->owner);
    p->claims = (delaunay__claims *)delaunay_alloc(m, (size_t)p->num_kernels, sizeof *p->claims);
    if (!first || !p->owner || !p->claims) {
        delaunay_release(m, first);
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    for (j = 0; j < num_cells; j++) {
        p->owner[j] = 0;
        first[j] = j ? p->mesh->vertices[begin + j * DELAUNAY__ROUND_A_CELL - 1].key : 0;
    }
    for (i = 0; i < p->num_kernels; i++) {
        delaunay__claims *claims = &p->claims[i];
        p->kernels[i]->claims = claims;
        claims->owner = p->owner;
        claims->own = (uint16_t)(i + 1);
        claims->num = 0;
        claims->enough = num_cells / (16 * (uint32_t)p->num_kernels);
        if (claims->enough > DELAUNAY__ENOUGH) claims->enough = DELAUNAY__ENOUGH;
    }
    delaunay__number_cells(p, count, first, num_cells);
    delaunay_release(m, first);
    return DELAUNAY_OK;
}

/* Inserts items that sections have left over, or that are too few for sections: each thread goes
 * along a part of the curve and claims the cells that it needs; an item that needs a cell of
 * another thread waits for the next attempt. The keys of vertices may be cell numbers afterwards.
 * Returns the number of items left over, or an error. */
static int64_t delaunay__run_claims(delaunay__partitions *p, uint32_t begin, uint32_t count,
                                    size_t num_items)
{
    enum { DELAUNAY__ITEMS_A_CLAIMER = 1000, DELAUNAY__ATTEMPTS = 4 };
    int64_t left = (int64_t)num_items;
    int attempt, num = p->num_kernels;
    if (left < 2 * DELAUNAY__ITEMS_A_CLAIMER) return left;
    if (delaunay__begin_claims(p, begin, count) != DELAUNAY_OK)
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    p->attempt++; /* tells the caller that keys must be computed again */
    for (attempt = 0; attempt < DELAUNAY__ATTEMPTS && left >= 0; attempt++) {
        const int64_t before = left;
        if (num > left / DELAUNAY__ITEMS_A_CLAIMER) num = (int)(left / DELAUNAY__ITEMS_A_CLAIMER);
        if (num <= 1) break;
        left = delaunay__attempt(p, (size_t)left, num, 0);
        if (2 * left > before) num /= 2;
    }
    delaunay__end_claims(p);
    return left;
}

/* For two threads: two halves of the closed curve are separated by a plane. The items that they
 * leave over are divided into halves that start a quarter of the curve later and are separated by
 * another plane, so that next to nothing, near the line where the planes meet, remains for one
 * thread. Returns the number of items left over, or an error. */
static int64_t delaunay__run_halves(delaunay__partitions *p, size_t num_items)
{
    int64_t left = (int64_t)num_items;
    int attempt;
    for (attempt = 0; attempt < 2 && left >= 2 * DELAUNAY__ITEMS_A_SECTION; attempt++) {
        const int64_t before = left;
        if (attempt) delaunay__turn_items(p->items, (size_t)left, (size_t)left / 4);
        left = delaunay__attempt(p, (size_t)left, 2, attempt == 0);
        if (left < 0 || 2 * left > before) break;
    }
    return left;
}

/* Inserts one round of items, the last vertices of the mesh, sorted by their keys on the unbent
 * curve. All rounds cut this curve at about the same places: earlier rounds have inserted points
 * near these cuts, too, so cavities there are small. With more than two threads, the items that the
 * sections leave over, or a round too small for sections, are divided by claims. */
static int delaunay__run_round(delaunay__partitions *p, uint32_t count, size_t num_items)
{
    enum { DELAUNAY__ROUND_A_SECTION = 30000 };
    int64_t left = (int64_t)num_items;
    if (p->num_kernels == 2) left = delaunay__run_halves(p, num_items);
    if (p->num_kernels > 2) {
        if (num_items / (size_t)p->num_kernels >= DELAUNAY__ROUND_A_SECTION)
            left = delaunay__attempt(p, num_items, p->num_kernels, 1);
        if (left >= 0)
            left = delaunay__run_claims(p, count - (uint32_t)num_items, count, (size_t)left);
    }
    if (left < 0) return (int)left;
    if (p->num_kernels > 1 && (size_t)left > num_items / 16)
        return delaunay__run_items(p, count, (size_t)left, 0);
    return delaunay__run_serial(p, (size_t)left);
}

DELAUNAY_API int delaunay_section_insert(delaunay_section *section, uint32_t vertex)
{
    int answer = delaunay__insert(section, vertex);
    if (answer == DELAUNAY__FOREIGN || answer == DELAUNAY__NEEDS_MEMORY)
        return DELAUNAY_ITEM_CONFLICT;
    return answer == DELAUNAY__NOT_HERE ? (int)DELAUNAY_ITEM_NOTHING : answer;
}

DELAUNAY_API int delaunay_section_owns(const delaunay_section *section, uint32_t vertex)
{
    return !section->parallel || !delaunay__is_foreign(section, vertex);
}

DELAUNAY_API int delaunay_section_owns_tet(const delaunay_section *section, delaunay_handle t)
{
    return !section->parallel || !delaunay__is_foreign_tet(section, t);
}

DELAUNAY_API delaunay_handle delaunay_section_hint(const delaunay_section *section)
{
    return section->hint;
}
DELAUNAY_API void delaunay_section_set_hint(delaunay_section *section, delaunay_handle t)
{
    section->hint = t;
}
DELAUNAY_API int delaunay_section_worker(const delaunay_section *section)
{
    return section->worker;
}

DELAUNAY_API int delaunay_section_take(delaunay_section *section, size_t count,
                                       delaunay_handle *slots)
{
    size_t i, room = section->num_freed + count + DELAUNAY__SLOTS_AT_ONCE;
    delaunay_result result = DELAUNAY_OK;
    if (section->parallel && room > section->cap_freed) result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    if (!section->parallel) result = delaunay__kernel_reserve_freed(section, room);
    if (result == DELAUNAY_OK) result = delaunay__ball_slots(section, count);
    if (result != DELAUNAY_OK) {
        section->needs_memory = 1;
        return section->parallel ? (int)DELAUNAY_ITEM_CONFLICT : (int)result;
    }
    for (i = 0; i < count; i++) slots[i] = section->freed[--section->num_freed];
    return DELAUNAY_ITEM_DONE;
}

DELAUNAY_API int delaunay_section_give(delaunay_section *section, const delaunay_handle *slots,
                                       size_t count)
{
    size_t i;
    delaunay_result result = DELAUNAY_OK;
    if (section->parallel && section->num_freed + count > section->cap_freed) {
        section->needs_memory = 1;
        return DELAUNAY_ITEM_CONFLICT;
    }
    if (!section->parallel)
        result = delaunay__kernel_reserve_freed(section, section->num_freed + count);
    if (result != DELAUNAY_OK) return result;
    for (i = 0; i < count; i++) {
        section->tets[slots[i]].v[0] = 0;
        section->freed[section->num_freed++] = slots[i];
    }
    return DELAUNAY_ITEM_DONE;
}

DELAUNAY_API delaunay_result delaunay_partition_run(delaunay_mesh *mesh, delaunay_partition *job,
                                                    const delaunay_host *host)
{
    /* A thread needs 100 KB. All vertices get keys, so those of a large mesh are worth threads,
     * even if few are to be inserted. */
    const size_t worth = 1 + mesh->num_vertices / DELAUNAY__ITEMS_A_SECTION;
    delaunay__partitions p;
    delaunay_memory *m = &mesh->memory;
    delaunay_host some;
    size_t i;
    int j, result;
    job->attempts = job->conflicts = 0;
    if (job->num_sections < 0) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    memset(&some, 0, sizeof some);
    if (host) some = *host;
    some.num_threads = delaunay_threads(host);
    if ((size_t)some.num_threads > worth) some.num_threads = (int)worth;
    result = delaunay__partitions_init(&p, mesh, job, &some, 0);
    if (result != DELAUNAY_OK) goto done;
    result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    p.items = (hxtsort_pair32 *)delaunay_alloc(m, job->num_vertices, sizeof *p.items);
    if (!p.items) goto done;
    for (i = 0; i < job->num_vertices; i++) {
        p.items[i].key = 0;
        p.items[i].value = job->vertices[i];
    }
    (void)hilbert_box_fit3(&p.box, mesh->vertices[1].x, sizeof *mesh->vertices,
                           mesh->num_vertices - 1, p.num_kernels);
    hilbert_box_cube(&p.box);
    p.all = (double)job->num_vertices;
    result = delaunay__next_curve(&p, mesh->num_vertices, job->num_vertices);
    if (result == DELAUNAY_OK)
        result = delaunay__run_items(&p, mesh->num_vertices, job->num_vertices, 1);
    for (j = 0; j < p.num_kernels; j++) {
        delaunay_result finished = delaunay__kernel_finish(p.kernels[j]);
        if (result == DELAUNAY_OK) result = finished;
    }
done:
    delaunay_release(m, p.items);
    delaunay__partitions_free(&p);
    return (delaunay_result)result;
}

/* ---- >>editing  stars, replacement of a cavity, constraint marks, locate -------------------- */
/* A worker's scratch. Sets and hash tables are emptied by raising their stamp: entries with an
 * older stamp count as empty. Memory is cleared only when the stamp overflows. */

/* An entry of a set of tetrahedra; present if its stamp is the set's. */
typedef struct delaunay__member {
    delaunay_handle t;
    uint32_t        stamp;
} delaunay__member;

/* What delaunay_replace knows about a facet, as a triple of vertices, or about an edge, as a pair
 * with v[2] = UINT32_MAX. A wall is a facet on the boundary of the cavity. */
typedef struct delaunay__face {
    uint32_t        v[3]; /* ascending */
    uint32_t        stamp;
    delaunay_handle at;   /* WALL: the facet's handle outside; HALF: number 4*i+k, see below */
    uint8_t         state, odd, constrained; /* odd: an odd permutation sorts the vertices to v */
} delaunay__face;

/* States of a delaunay__face.
 * OLD: no new tetrahedron has been found to have it. WALL: of the cavity, its inner side still
 * without a new tetrahedron. HALF: facet k of new tetrahedron i, without its other side so far.
 * DONE: both sides are known. */
enum { DELAUNAY__FACE_OLD, DELAUNAY__FACE_WALL, DELAUNAY__FACE_HALF, DELAUNAY__FACE_DONE };

typedef struct delaunay__search_tables delaunay__search_tables;

struct delaunay_worker {
    delaunay_memory  *memory;
    delaunay__member *set;         /* 1 << set_bits entries, at most half of them in use */
    int               set_bits;
    size_t            set_count;
    uint32_t          set_stamp;
    delaunay_list     queue;
    delaunay__face   *faces;       /* 1 << face_bits entries */
    int               face_bits;
    uint32_t          face_stamp;
    /* as in delaunay_links; per new tetrahedron: */
    delaunay_handle  *link;        /* 4: the facets beyond, of the mesh or new ones (4*i+k) */
    uint8_t          *link_inside; /* 4: nonzero if the facet beyond is a new one */
    uint16_t         *link_flags;  /* 1: the constraint bits that persist */
    size_t            cap_link;
    uint32_t         *commit;      /* vertices of new tetrahedra, for delaunay_window_apply */
    delaunay__search_tables *tables;
    int                      has_tables; /* they are prepared */
};

static size_t delaunay__size_of_tables(void);

static size_t delaunay__hash(uint64_t key, int bits)
{
    return (size_t)((key * 0x9E3779B97F4A7C15u) >> (64 - bits));
}

static void delaunay__set_clear(delaunay_worker *w)
{
    w->set_count = 0;
    if (++w->set_stamp == 0) {
        memset(w->set, 0, sizeof *w->set << w->set_bits);
        w->set_stamp = 1;
    }
}

DELAUNAY_INLINE delaunay__member *delaunay__set_find(const delaunay_worker *w, delaunay_handle t)
{
    size_t mask = ((size_t)1 << w->set_bits) - 1, i = delaunay__hash(t, w->set_bits);
    while (w->set[i].stamp == w->set_stamp && w->set[i].t != t) i = (i + 1) & mask;
    return &w->set[i];
}

DELAUNAY_INLINE int delaunay__set_has(const delaunay_worker *w, delaunay_handle t)
{
    return delaunay__set_find(w, t)->stamp == w->set_stamp;
}

static delaunay_result delaunay__set_grow(delaunay_worker *w)
{
    delaunay__member *old = w->set;
    size_t i, n = (size_t)1 << w->set_bits;
    w->set = (delaunay__member *)delaunay_alloc(w->memory, 2 * n, sizeof *w->set);
    if (!w->set) {
        w->set = old;
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    memset(w->set, 0, 2 * n * sizeof *w->set);
    w->set_bits++;
    for (i = 0; i < n; i++)
        if (old[i].stamp == w->set_stamp) *delaunay__set_find(w, old[i].t) = old[i];
    delaunay_release(w->memory, old);
    return DELAUNAY_OK;
}

/* *added: 1 if t was not in the set. */
static delaunay_result delaunay__set_add(delaunay_worker *w, delaunay_handle t, int *added)
{
    delaunay__member *m = delaunay__set_find(w, t);
    *added = m->stamp != w->set_stamp;
    if (!*added) return DELAUNAY_OK;
    if (2 * (w->set_count + 1) > (size_t)1 << w->set_bits) {
        delaunay_result result = delaunay__set_grow(w);
        if (result != DELAUNAY_OK) return result;
        m = delaunay__set_find(w, t);
    }
    w->set_count++;
    m->t = t;
    m->stamp = w->set_stamp;
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_worker *delaunay_worker_new(delaunay_memory *memory)
{
    delaunay_worker *w = (delaunay_worker *)delaunay_alloc_zeroed(memory, 1, sizeof *w);
    if (!w) return NULL;
    w->memory = w->queue.memory = memory;
    w->set_bits = 11;
    w->face_bits = 9;
    w->set = (delaunay__member *)delaunay_alloc_zeroed(memory, (size_t)1 << w->set_bits,
                                                       sizeof *w->set);
    w->faces = (delaunay__face *)delaunay_alloc_zeroed(memory, (size_t)1 << w->face_bits,
                                                       sizeof *w->faces);
    w->commit = (uint32_t *)delaunay_alloc(memory, 4 * DELAUNAY_WINDOW_TETS, sizeof *w->commit);
    w->tables = (delaunay__search_tables *)delaunay_alloc(memory, 1, delaunay__size_of_tables());
    if (!w->set || !w->faces || !w->commit || !w->tables) {
        delaunay_worker_free(w);
        return NULL;
    }
    return w;
}

DELAUNAY_API void delaunay_worker_free(delaunay_worker *worker)
{
    delaunay_memory *m;
    if (!worker) return;
    m = worker->memory;
    delaunay_list_free(&worker->queue);
    delaunay_release(m, worker->set);
    delaunay_release(m, worker->faces);
    delaunay_release(m, worker->link);
    delaunay_release(m, worker->link_inside);
    delaunay_release(m, worker->link_flags);
    delaunay_release(m, worker->commit);
    delaunay_release(m, worker->tables);
    delaunay_release(m, worker);
}

#  define DELAUNAY__NO_VERTEX UINT32_MAX

/* Collects the star of a, breadth first, in out. If b is not NO_VERTEX, stops at the first
 * tetrahedron that contains b and c, and returns it in *found; *found is 0 if there is none. */
static delaunay_result delaunay__star(const delaunay_mesh *mesh, delaunay_worker *worker,
                                      uint32_t a, uint32_t b, uint32_t c, delaunay_list *out,
                                      delaunay_handle *found)
{
    delaunay_handle t;
    size_t head;
    int i, added;
    out->count = 0;
    *found = 0;
    if (!mesh->vertex_tet) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    t = mesh->vertex_tet[a];
    if (t == 0) return DELAUNAY_OK;
    delaunay__set_clear(worker);
    if (delaunay__set_add(worker, t, &added) != DELAUNAY_OK ||
        delaunay_list_push(out, t) != DELAUNAY_OK)
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    for (head = 0; head < out->count; head++) {
        const delaunay_tet *tet = &mesh->tets[out->items[head]];
        if (b != DELAUNAY__NO_VERTEX && delaunay_local_index(tet, b) >= 0 &&
            (b == c || delaunay_local_index(tet, c) >= 0)) {
            *found = out->items[head];
            return DELAUNAY_OK;
        }
        for (i = 0; i < 4; i++) {
            t = tet->n[i] / 4;
            if (tet->v[i] == a || t == 0 || delaunay__set_has(worker, t)) continue;
            if (delaunay__set_add(worker, t, &added) != DELAUNAY_OK)
                return DELAUNAY_ERROR_OUT_OF_MEMORY;
            if (delaunay_list_push(out, t) != DELAUNAY_OK) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        }
    }
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_vertex_star(const delaunay_mesh *mesh,
                                                  delaunay_worker *worker, uint32_t v,
                                                  delaunay_list *out)
{
    delaunay_handle found;
    if (!out->memory) out->memory = worker->memory;
    return delaunay__star(mesh, worker, v, DELAUNAY__NO_VERTEX, DELAUNAY__NO_VERTEX, out, &found);
}

/* One step around an edge: from tetrahedron *t across the facet opposite its vertex *out, where
 * *out and *keep are the two vertices of *t that are not on the edge. Updates all three. */
static void delaunay__turn(const delaunay_mesh *mesh, delaunay_handle *t, uint32_t *out,
                           uint32_t *keep)
{
    const delaunay_tet *tet = &mesh->tets[*t];
    delaunay_handle h = tet->n[delaunay_local_index(tet, *out)];
    *t = h / 4;
    *out = *keep;
    *keep = mesh->tets[h / 4].v[h & 3];
}

DELAUNAY_API delaunay_result delaunay_edge_star(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                delaunay_handle t, uint32_t a, uint32_t b,
                                                delaunay_list *out)
{
    const delaunay_tet *tet = &mesh->tets[t];
    int i = delaunay_local_index(tet, a), j = delaunay_local_index(tet, b), k, l;
    uint32_t leave, keep;
    delaunay_handle u = t;
    size_t n, m;
    if (!out->memory) out->memory = worker->memory;
    out->count = 0;
    if (i < 0 || j < 0 || i == j) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    for (k = 0; k == i || k == j; k++) {}
    l = 6 - i - j - k;
    leave = tet->v[k];
    keep = tet->v[l];
    do {
        if (delaunay_list_push(out, u) != DELAUNAY_OK) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        delaunay__turn(mesh, &u, &leave, &keep);
    } while (u != t && u != 0);
    if (u == t) return DELAUNAY_OK;
    /* The star is open. out holds the part of it in one direction from t: reverse this part, so
     * that t is last, then append the part in the other direction. */
    for (n = 0, m = out->count; n + 1 < m; n++, m--) {
        delaunay_handle swap = out->items[n];
        out->items[n] = out->items[m - 1];
        out->items[m - 1] = swap;
    }
    u = t;
    leave = tet->v[l];
    keep = tet->v[k];
    for (delaunay__turn(mesh, &u, &leave, &keep); u != 0; delaunay__turn(mesh, &u, &leave, &keep))
        if (delaunay_list_push(out, u) != DELAUNAY_OK) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    return DELAUNAY_OK;
}

/* A tetrahedron that contains all three vertices, some of which may be equal, or 0. Walks from a to
 * the others; looks at all tetrahedra if there is no memory for that. */
static delaunay_handle delaunay__find(const delaunay_mesh *mesh, delaunay_worker *worker,
                                      uint32_t a, uint32_t b, uint32_t c)
{
    delaunay_handle t;
    if (delaunay__star(mesh, worker, a, b, c, &worker->queue, &t) != DELAUNAY_ERROR_OUT_OF_MEMORY)
        return t;
    for (t = 1; t < mesh->num_tets; t++) {
        const delaunay_tet *tet = &mesh->tets[t];
        if (!delaunay_is_deleted(mesh, t) && delaunay_local_index(tet, a) >= 0 &&
            delaunay_local_index(tet, b) >= 0 && delaunay_local_index(tet, c) >= 0)
            return t;
    }
    return 0;
}

DELAUNAY_API delaunay_handle delaunay_find_edge(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                uint32_t a, uint32_t b)
{
    if (a == DELAUNAY_GHOST) { /* whose star would be the whole hull */
        a = b;
        b = DELAUNAY_GHOST;
    }
    return a == DELAUNAY_GHOST ? 0 : delaunay__find(mesh, worker, a, b, b);
}

DELAUNAY_API delaunay_handle delaunay_find_facet(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                 uint32_t a, uint32_t b, uint32_t c)
{
    delaunay_handle found;
    const delaunay_tet *tet;
    int i;
    if (a == DELAUNAY_GHOST) {
        a = b;
        b = DELAUNAY_GHOST;
    }
    if (a == DELAUNAY_GHOST || (b == DELAUNAY_GHOST && c == DELAUNAY_GHOST)) return 0;
    found = delaunay__find(mesh, worker, a, b, c);
    if (found == 0) return 0;
    tet = &mesh->tets[found];
    for (i = 0; tet->v[i] == a || tet->v[i] == b || tet->v[i] == c; i++) {}
    return 4 * found + (delaunay_handle)i;
}

/* Position of a point relative to facet i of a real tetrahedron: 1 strictly beyond the facet's
 * plane, 0 in it, -1 on the side of the tetrahedron. */
static int delaunay__beyond(const delaunay_mesh *mesh, const delaunay_tet *tet, int i,
                            const double *xyz)
{
    const uint8_t *f = delaunay_facet_order(i);
    const delaunay_vertex *v = mesh->vertices;
    return delaunay_orient3d(v[tet->v[f[0]]].x, v[tet->v[f[1]]].x, v[tet->v[f[2]]].x, xyz);
}

/* A ghost sees the points strictly outside the hull facet 0, 1, 2. These three vertices are in the
 * opposite order to that of the same facet of the real neighbour, hence the sign. */
static int delaunay__sees(const delaunay_mesh *mesh, const delaunay_tet *ghost, const double *xyz)
{
    const delaunay_vertex *v = mesh->vertices;
    return delaunay_orient3d(v[ghost->v[0]].x, v[ghost->v[1]].x, v[ghost->v[2]].x, xyz) > 0;
}

static delaunay_handle delaunay__locate_by_scan(const delaunay_mesh *mesh, const double *xyz)
{
    delaunay_handle t, ghost = 0;
    int i;
    for (t = 1; t < mesh->num_tets; t++) {
        const delaunay_tet *tet = &mesh->tets[t];
        if (delaunay_is_deleted(mesh, t)) continue;
        if (delaunay_is_ghost(mesh, t)) {
            if (!ghost && delaunay__sees(mesh, tet, xyz)) ghost = t;
            continue;
        }
        for (i = 0; i < 4 && delaunay__beyond(mesh, tet, i, xyz) <= 0; i++) {}
        if (i == 4) return t;
    }
    return ghost;
}

/* Visibility walk: it crosses a facet that strictly separates the tetrahedron from the point. In a
 * mesh that is not Delaunay it might cycle, so the first facet to be tested is drawn by a
 * pseudo-random sequence with a fixed seed, and the number of steps is bounded. If the walk ends at
 * a facet without neighbour, the mesh may be non-convex, and only the scan can give the answer. */
DELAUNAY_API delaunay_handle delaunay_locate(const delaunay_mesh *mesh, const double *xyz,
                                             delaunay_handle hint)
{
    delaunay_handle t = hint, from = 0, steps, limit = mesh->num_tets + 1000;
    uint32_t random = 2463534242u;
    if (!delaunay__is_finite(xyz)) return 0;
    if (t == 0 || t >= mesh->num_tets || delaunay_is_deleted(mesh, t))
        for (t = mesh->num_tets ? mesh->num_tets - 1 : 0; t > 0 && delaunay_is_deleted(mesh, t);
             t--) {}
    if (t == 0) return 0;
    if (delaunay_is_ghost(mesh, t)) {
        if (delaunay__sees(mesh, &mesh->tets[t], xyz)) return t;
        t = mesh->tets[t].n[3] / 4;
    }
    for (steps = 0; t != 0 && steps < limit; steps++) {
        const delaunay_tet *tet = &mesh->tets[t];
        int k, i = 0, wall = 0;
        random ^= random << 13;
        random ^= random >> 17;
        random ^= random << 5;
        for (k = 0; k < 4; k++) {
            i = (int)((random + (uint32_t)k) & 3u);
            if (tet->n[i] == from && from != 0) continue;
            if (delaunay__beyond(mesh, tet, i, xyz) <= 0) continue;
            if (tet->n[i] != 0) break;
            wall = 1;
        }
        if (k == 4 && wall) break;
        if (k == 4) return t;
        from = 4 * t + (delaunay_handle)i;
        t = tet->n[i] / 4;
        if (delaunay_is_ghost(mesh, t)) return t;
    }
    return delaunay__locate_by_scan(mesh, xyz);
}

/* -- delaunay_replace: first finds the links of the new tetrahedra, in the worker's memory, without
 * a change of the mesh; then writes the mesh. */

static void delaunay__faces_clear(delaunay_worker *w)
{
    if (++w->face_stamp == 0) {
        memset(w->faces, 0, sizeof *w->faces << w->face_bits);
        w->face_stamp = 1;
    }
}

/* Makes room for num_new new tetrahedra and for num_faces entries in the table, and clears that. */
static delaunay_result delaunay__replace_scratch(delaunay_worker *w, size_t num_new,
                                                 size_t num_faces)
{
    if (num_new > w->cap_link) {
        size_t cap = num_new + num_new / 2 + 64;
        delaunay_release(w->memory, w->link);
        delaunay_release(w->memory, w->link_inside);
        delaunay_release(w->memory, w->link_flags);
        w->cap_link = 0;
        w->link = (delaunay_handle *)delaunay_alloc(w->memory, cap, 4 * sizeof *w->link);
        w->link_inside = (uint8_t *)delaunay_alloc(w->memory, cap, 4 * sizeof *w->link_inside);
        w->link_flags = (uint16_t *)delaunay_alloc(w->memory, cap, sizeof *w->link_flags);
        if (!w->link || !w->link_inside || !w->link_flags) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        w->cap_link = cap;
    }
    if (2 * num_faces > (size_t)1 << w->face_bits) {
        int bits = w->face_bits;
        void *table;
        while (2 * num_faces > (size_t)1 << bits) bits++;
        table = delaunay_alloc(w->memory, (size_t)1 << bits, sizeof *w->faces);
        if (!table) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        delaunay_release(w->memory, w->faces);
        w->faces = (delaunay__face *)table;
        w->face_bits = bits;
        memset(w->faces, 0, sizeof *w->faces << bits);
    }
    delaunay__faces_clear(w);
    return DELAUNAY_OK;
}

/* The entry of a triple of vertices, given in any order, or the free entry where it would be put;
 * v: the triple in ascending order. */
static delaunay__face *delaunay__face_place(const delaunay_worker *w, uint32_t a, uint32_t b,
                                            uint32_t c, uint32_t *v)
{
    uint32_t lo = a < b ? a : b, hi = a < b ? b : a;
    size_t mask = ((size_t)1 << w->face_bits) - 1, i;
    delaunay__face *f;
    v[0] = lo < c ? lo : c;
    v[2] = hi > c ? hi : c;
    v[1] = a ^ b ^ c ^ v[0] ^ v[2];
    i = delaunay__hash(((uint64_t)v[0] << 32 | v[1]) ^ (uint64_t)v[2] * 0xD6E8FEB86659FD93u,
                       w->face_bits);
    for (f = &w->faces[i]; f->stamp == w->face_stamp; f = &w->faces[i]) {
        if (f->v[0] == v[0] && f->v[1] == v[1] && f->v[2] == v[2]) return f;
        i = (i + 1) & mask;
    }
    return f;
}

/* The entry of a triple, which is added if it is not there: in state OLD, unconstrained. */
static delaunay__face *delaunay__face_entry(delaunay_worker *w, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t v[3];
    delaunay__face *f = delaunay__face_place(w, a, b, c, v);
    if (f->stamp == w->face_stamp) return f;
    memcpy(f->v, v, sizeof v);
    f->stamp = w->face_stamp;
    f->state = DELAUNAY__FACE_OLD;
    f->at = 0;
    f->odd = f->constrained = 0;
    return f;
}

/* The entry of a triple, or NULL if there is none. */
static const delaunay__face *delaunay__face_find(const delaunay_worker *w, uint32_t a, uint32_t b,
                                                 uint32_t c)
{
    uint32_t v[3];
    const delaunay__face *f = delaunay__face_place(w, a, b, c, v);
    return f->stamp == w->face_stamp ? f : NULL;
}

/* Edges are in the same table as facets; UINT32_MAX is not the number of any vertex. */
static delaunay__face *delaunay__edge_entry(delaunay_worker *w, uint32_t a, uint32_t b)
{
    return delaunay__face_entry(w, a, b, UINT32_MAX);
}

static uint8_t delaunay__odd(uint32_t a, uint32_t b, uint32_t c)
{
    return (uint8_t)((a > b) ^ (a > c) ^ (b > c));
}

/* Enters the walls, and the constrained edges and interior facets, of the old tetrahedra into the
 * table; marked: some of these have constraint bits. Returns the number of walls. */
static size_t delaunay__replace_enter_old(const delaunay_mesh *mesh, delaunay_worker *w,
                                          const delaunay_handle *old, size_t num_old, int marked)
{
    size_t i, walls = 0;
    int k;
    for (i = 0; i < num_old; i++) {
        const delaunay_tet *t = &mesh->tets[old[i]];
        unsigned flags = marked ? mesh->flags[old[i]] : 0;
        for (k = 0; k < 4; k++) {
            const uint8_t *o = delaunay_facet_order(k);
            uint32_t a = t->v[o[0]], b = t->v[o[1]], c = t->v[o[2]];
            int wall = t->n[k] == 0 || !delaunay__set_has(w, t->n[k] / 4);
            delaunay__face *f;
            if (!wall && !(flags & DELAUNAY_FACET_BIT(k))) continue;
            f = delaunay__face_entry(w, a, b, c);
            if (flags & DELAUNAY_FACET_BIT(k)) f->constrained = 1;
            if (!wall) continue;
            f->state = DELAUNAY__FACE_WALL;
            f->odd = delaunay__odd(a, b, c);
            f->at = t->n[k];
            walls++;
        }
        for (k = 0; k < 6 && (flags & DELAUNAY_EDGE_BITS); k++)
            if (flags & DELAUNAY_EDGE_BIT(k)) {
                const uint8_t *o = delaunay_edge_order(k);
                delaunay__edge_entry(w, t->v[o[0]], t->v[o[1]])->constrained = 1;
            }
    }
    return walls;
}

/* Links facet k of new tetrahedron i to its other side if that is known, else enters it as HALF.
 * Returns the change in the number of facets that wait for their other side, or 2 if the facet
 * would have a third side or has the wrong orientation. */
static int delaunay__replace_enter_facet(delaunay_worker *w, const uint32_t *v, size_t i, int k)
{
    const uint8_t *o = delaunay_facet_order(k);
    delaunay__face *f = delaunay__face_entry(w, v[o[0]], v[o[1]], v[o[2]]);
    uint8_t odd = delaunay__odd(v[o[0]], v[o[1]], v[o[2]]);
    size_t here = 4 * i + (size_t)k;
    if (f->constrained) w->link_flags[i] = (uint16_t)(w->link_flags[i] | DELAUNAY_FACET_BIT(k));
    switch (f->state) {
    case DELAUNAY__FACE_OLD:
        f->state = DELAUNAY__FACE_HALF;
        f->odd = odd;
        f->at = (delaunay_handle)here;
        return 1;
    case DELAUNAY__FACE_WALL:
        if (f->odd != odd) return 2;
        w->link[here] = f->at;
        w->link_inside[here] = 0;
        break;
    case DELAUNAY__FACE_HALF:
        if (f->odd == odd) return 2;
        w->link[here] = f->at;
        w->link[f->at] = (delaunay_handle)here;
        w->link_inside[here] = w->link_inside[f->at] = 1;
        break;
    default: return 2;
    }
    f->state = DELAUNAY__FACE_DONE;
    return -1;
}

/* Computes the links and flags of the new tetrahedra, in the worker, or returns the error that
 * delaunay_replace returns. Reads only the old tetrahedra, writes only the worker. */
static delaunay_result delaunay__replace_links(const delaunay_mesh *mesh, delaunay_worker *w,
                                               const delaunay_handle *old, size_t num_old,
                                               const uint32_t *vertices, size_t num_new)
{
    size_t i, waiting, num_edges = 0;
    unsigned any = 0;
    int k, added, change;
    delaunay_result result;
    delaunay__set_clear(w);
    for (i = 0; i < num_old; i++) {
        if (old[i] == 0 || old[i] >= mesh->num_tets || delaunay_is_deleted(mesh, old[i]))
            return DELAUNAY_ERROR_INVALID_ARGUMENT;
        result = delaunay__set_add(w, old[i], &added);
        if (result != DELAUNAY_OK) return result;
        if (!added) return DELAUNAY_ERROR_INVALID_ARGUMENT;
        if (mesh->flags) any |= mesh->flags[old[i]];
    }
    any &= DELAUNAY_FACET_BITS | DELAUNAY_EDGE_BITS;
    if (any & DELAUNAY_EDGE_BITS) num_edges = 6 * (num_old + num_new);
    result = delaunay__replace_scratch(w, num_new, 4 * (num_old + num_new) + num_edges);
    if (result != DELAUNAY_OK) return result;
    waiting = delaunay__replace_enter_old(mesh, w, old, num_old, any != 0);
    for (i = 0; i < num_new; i++) {
        const uint32_t *v = vertices + 4 * i;
        w->link_flags[i] = 0;
        for (k = 0; k < 4; k++) {
            change = delaunay__replace_enter_facet(w, v, i, k);
            if (change == 2) return DELAUNAY_ERROR_INTERNAL;
            waiting += (size_t)change;
        }
        if (!num_edges) continue;
        for (k = 0; k < 6; k++) {
            const uint8_t *o = delaunay_edge_order(k);
            if (delaunay__edge_entry(w, v[o[0]], v[o[1]])->constrained)
                w->link_flags[i] = (uint16_t)(w->link_flags[i] | DELAUNAY_EDGE_BIT(k));
        }
    }
    return waiting ? DELAUNAY_ERROR_INTERNAL : DELAUNAY_OK;
}

/* Writes the new tetrahedra with their links to slots, which exist, and updates the handles of the
 * surrounding tetrahedra. Nothing else is changed; vertex_tet is left to the caller. */
static void delaunay__replace_write(delaunay_mesh *mesh, const delaunay_links *links,
                                    uint32_t color, const uint32_t *vertices, size_t num_new,
                                    const delaunay_handle *slots)
{
    size_t i;
    int k;
    for (i = 0; i < num_new; i++) {
        delaunay_handle t = slots[i], link;
        delaunay_tet *tet = &mesh->tets[t];
        memcpy(tet->v, vertices + 4 * i, sizeof tet->v);
        for (k = 0; k < 4; k++) {
            link = links->link[4 * i + (size_t)k];
            if (links->inside[4 * i + (size_t)k]) {
                tet->n[k] = 4 * slots[link / 4] + link % 4;
            } else {
                tet->n[k] = link;
                if (link) mesh->tets[link / 4].n[link % 4] = 4 * t + (delaunay_handle)k;
            }
        }
        mesh->mark[t] = 0;
        if (mesh->flags) mesh->flags[t] = links->flags[i];
        if (mesh->color) mesh->color[t] = color;
    }
}

static void delaunay__delete_tet(delaunay_mesh *mesh, delaunay_handle t)
{
    memset(&mesh->tets[t], 0, sizeof mesh->tets[t]);
    mesh->mark[t] = 0;
    if (mesh->flags) mesh->flags[t] = 0;
    if (mesh->color) mesh->color[t] = 0;
}

/* Makes room for so many entries in free_tets. */
static delaunay_result delaunay__reserve_free(delaunay_mesh *mesh, size_t count)
{
    size_t cap = count + count / 2 + 256;
    if (count <= mesh->cap_free) return DELAUNAY_OK;
    DELAUNAY__GROW(delaunay_handle, free_tets, mesh->num_free, cap);
    mesh->cap_free = (delaunay_handle)cap;
    return DELAUNAY_OK;
}

/* Makes room for the slots that delaunay_replace needs beyond the old and the free ones, or for the
 * entries of those that it frees. */
static delaunay_result delaunay__replace_reserve(delaunay_mesh *mesh, size_t num_old,
                                                 size_t num_new)
{
    size_t total;
    if (num_new <= num_old)
        return delaunay__reserve_free(mesh, mesh->num_free + (num_old - num_new));
    total = num_new - num_old;
    if (total <= mesh->num_free) return DELAUNAY_OK;
    total = mesh->num_tets + (total - mesh->num_free);
    return total <= mesh->cap_tets ? DELAUNAY_OK
                                   : delaunay__grow_tets(mesh, total, total + total / 2 + 64);
}

DELAUNAY_API delaunay_result delaunay_replace_linked(delaunay_mesh *mesh, delaunay_worker *worker,
                                                     const delaunay_handle *old_tets,
                                                     size_t num_old, const uint32_t *vertices,
                                                     const delaunay_links *links, size_t num_new,
                                                     delaunay_handle *slots)
{
    delaunay_result result = delaunay__replace_reserve(mesh, num_old, num_new);
    uint32_t color = mesh->color && num_old ? mesh->color[old_tets[0]] : 0;
    size_t i;
    int k;
    worker->queue.count = 0;
    for (i = 0; result == DELAUNAY_OK && i < num_new; i++)
        result = delaunay_list_push(&worker->queue, 0);
    if (result != DELAUNAY_OK) return result;
    for (i = 0; i < num_old; i++) {
        if (mesh->vertex_tet)
            for (k = 0; k < 4; k++) {
                uint32_t v = mesh->tets[old_tets[i]].v[k];
                if (mesh->vertex_tet[v] == old_tets[i]) mesh->vertex_tet[v] = 0;
            }
        if (i < num_new) continue;
        delaunay__delete_tet(mesh, old_tets[i]);
        mesh->free_tets[mesh->num_free++] = old_tets[i];
    }
    for (i = 0; i < num_new; i++)
        worker->queue.items[i] = i < num_old     ? old_tets[i]
                                 : mesh->num_free ? mesh->free_tets[--mesh->num_free]
                                                  : mesh->num_tets++;
    delaunay__replace_write(mesh, links, color, vertices, num_new, worker->queue.items);
    for (i = 0; mesh->vertex_tet && i < 4 * num_new; i++)
        mesh->vertex_tet[vertices[i]] = worker->queue.items[i / 4];
    if (slots && num_new) memcpy(slots, worker->queue.items, num_new * sizeof *slots);
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_replace(delaunay_mesh *mesh, delaunay_worker *worker,
                                              const delaunay_handle *old_tets, size_t num_old,
                                              const uint32_t *vertices, size_t num_new,
                                              delaunay_handle *slots)
{
    delaunay_result result =
        delaunay__replace_links(mesh, worker, old_tets, num_old, vertices, num_new);
    delaunay_links links;
    if (result != DELAUNAY_OK) return result;
    links.link = worker->link;
    links.inside = worker->link_inside;
    links.flags = worker->link_flags;
    return delaunay_replace_linked(mesh, worker, old_tets, num_old, vertices, &links, num_new,
                                   slots);
}

DELAUNAY_API void delaunay_mark_facet(delaunay_mesh *mesh, delaunay_handle f, int constrained)
{
    delaunay_handle side[2];
    int i;
    side[0] = f;
    side[1] = mesh->tets[f / 4].n[f % 4];
    for (i = 0; i < 2; i++) {
        uint16_t *flags = &mesh->flags[side[i] / 4];
        unsigned bit = DELAUNAY_FACET_BIT(side[i] % 4);
        if (side[i]) *flags = (uint16_t)(constrained ? *flags | bit : *flags & ~bit);
    }
}

DELAUNAY_API delaunay_result delaunay_mark_edge(delaunay_mesh *mesh, delaunay_worker *worker,
                                                delaunay_handle t, uint32_t a, uint32_t b,
                                                int constrained)
{
    delaunay_result result = delaunay_edge_star(mesh, worker, t, a, b, &worker->queue);
    size_t i;
    if (result != DELAUNAY_OK) return result;
    for (i = 0; i < worker->queue.count; i++) {
        const delaunay_tet *tet = &mesh->tets[worker->queue.items[i]];
        uint16_t *flags = &mesh->flags[worker->queue.items[i]];
        unsigned bit = DELAUNAY_EDGE_BIT(
            delaunay_edge_between(delaunay_local_index(tet, a), delaunay_local_index(tet, b)));
        *flags = (uint16_t)(constrained ? *flags | bit : *flags & ~bit);
    }
    return DELAUNAY_OK;
}

/* ---- >>changing  points into and out of a finished triangulation ----------------------------- */
struct delaunay_editor {
    delaunay_mesh    *mesh;
    delaunay__kernel  kernel;
    delaunay_worker  *worker;
    delaunay_list     star;   /* of the vertex to be removed */
    delaunay_list     inside; /* tetrahedra of the corners' own triangulation that fill the hole */
    uint32_t         *corners; /* vertices of the hole that a removal leaves, without the ghost */
    double           *xyz;     /* their coordinates */
    uint32_t         *tets;    /* 4 vertices per tetrahedron that will fill the hole */
    delaunay_handle  *slots;   /* where each of them is then */
    size_t            cap_corners, cap_tets;
};

/* True if every facet has a neighbour and the mesh has ghosts, that is, a hull. */
static int delaunay__is_closed(const delaunay_mesh *mesh)
{
    delaunay_handle t, ghosts = 0;
    for (t = 1; t < mesh->num_tets; t++) {
        const delaunay_tet *x = &mesh->tets[t];
        if (delaunay_is_deleted(mesh, t)) continue;
        if (!x->n[0] || !x->n[1] || !x->n[2] || !x->n[3]) return 0;
        if (delaunay_is_ghost(mesh, t)) ghosts++;
    }
    return ghosts > 0;
}

DELAUNAY_API void delaunay_editor_free(delaunay_editor *editor)
{
    delaunay_memory *m;
    if (!editor) return;
    m = &editor->mesh->memory;
    delaunay__kernel_free(&editor->kernel);
    delaunay_worker_free(editor->worker);
    delaunay_list_free(&editor->star);
    delaunay_list_free(&editor->inside);
    delaunay_release(m, editor->corners);
    delaunay_release(m, editor->xyz);
    delaunay_release(m, editor->tets);
    delaunay_release(m, editor->slots);
    delaunay_release(m, editor);
}

DELAUNAY_API delaunay_editor *delaunay_editor_new(delaunay_mesh *mesh)
{
    delaunay_editor *e;
    if (!mesh || !mesh->tets || mesh->weight || !delaunay__is_closed(mesh)) return NULL;
    e = (delaunay_editor *)delaunay_alloc_zeroed(&mesh->memory, 1, sizeof *e);
    if (!e) return NULL;
    e->mesh = mesh;
    e->star.memory = e->inside.memory = &mesh->memory;
    e->worker = delaunay_worker_new(&mesh->memory);
    if (!e->worker || delaunay__kernel_init(&e->kernel, mesh) != DELAUNAY_OK ||
        delaunay_link_vertices(mesh) != DELAUNAY_OK) {
        delaunay_editor_free(e);
        return NULL;
    }
    return e;
}

/* After an insertion: updates what the kernel does not, namely vertex_tet, and the flags and
 * colours of new and deleted tetrahedra. */
static void delaunay__editor_link(delaunay_editor *e)
{
    delaunay_mesh *mesh = e->mesh;
    const delaunay__kernel *k = &e->kernel;
    size_t j;
    int i;
    for (j = 0; j < k->num_cavity; j++) {
        delaunay_handle t = k->cavity[j] >> 2;
        if (mesh->flags) mesh->flags[t] = 0;
        if (mesh->color) mesh->color[t] = 0;
    }
    for (j = 0; j < k->num_border; j++) {
        delaunay_handle h = k->border[j], t = mesh->tets[h >> 2].n[h & 3] >> 2;
        for (i = 0; i < 4; i++) mesh->vertex_tet[mesh->tets[t].v[i]] = t;
        if (mesh->flags) mesh->flags[t] = 0;
        if (mesh->color) mesh->color[t] = 0;
    }
}

/* The vertex of tetrahedron t that is at xyz, or 0. */
static uint32_t delaunay__corner_at(const delaunay_mesh *mesh, delaunay_handle t, const double *xyz)
{
    const uint32_t *v = mesh->tets[t].v;
    int i;
    for (i = 0; i < 4; i++)
        if (v[i] && delaunay__compare_points(mesh->vertices[v[i]].x, xyz) == 0) return v[i];
    return 0;
}

/* Inserts a vertex that is in no tetrahedron. *same: 0, or another vertex at the same place; then
 * nothing has changed. */
static delaunay_result delaunay__editor_put(delaunay_editor *e, uint32_t v, delaunay_handle hint,
                                            uint32_t *same)
{
    enum { DELAUNAY__EDITOR_SLOTS = 2048 };
    delaunay__kernel *k = &e->kernel;
    int result;
    *same = 0;
    delaunay__kernel_view(k);
    if (hint && hint < e->mesh->num_tets && !delaunay_is_deleted(e->mesh, hint)) k->hint = hint;
    k->hint = delaunay__any_tet(e->mesh, k->hint);
    if (k->hint == DELAUNAY_NONE) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    if (delaunay__reserve_free(e->mesh, (size_t)e->mesh->num_free + DELAUNAY__EDITOR_SLOTS) !=
        DELAUNAY_OK)
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    result = delaunay__insert(k, v);
    /* Gives the freed slots to the mesh, as other edits may come before the next insertion. If
     * there is no memory for a list of thousands, the slots stay deleted and are not used again. */
    if (delaunay__kernel_finish(k) != DELAUNAY_OK) k->num_freed = 0;
    if (result == DELAUNAY__NOT_HERE) {
        *same = delaunay__corner_at(e->mesh, k->hint, e->mesh->vertices[v].x);
        return *same ? DELAUNAY_OK : DELAUNAY_ERROR_INTERNAL;
    }
    if (result < 0) return (delaunay_result)result;
    if (result != DELAUNAY_OK) return DELAUNAY_ERROR_INTERNAL;
    delaunay__editor_link(e);
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_editor_insert(delaunay_editor *editor, const double *xyz,
                                                    uint32_t id, delaunay_handle hint,
                                                    uint32_t *vertex)
{
    delaunay_mesh *mesh;
    delaunay_result result;
    uint32_t v, same;
    if (vertex) *vertex = 0;
    if (!editor || !xyz) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    if (!delaunay__is_finite(xyz)) return DELAUNAY_ERROR_NOT_FINITE;
    mesh = editor->mesh;
    if (mesh->num_vertices >= UINT32_MAX - 16) return DELAUNAY_ERROR_TOO_LARGE;
    v = delaunay_add_vertex(mesh, xyz, id);
    if (v == 0) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    result = delaunay__editor_put(editor, v, hint, &same);
    if (result != DELAUNAY_OK || same) mesh->num_vertices--;
    if (result == DELAUNAY_OK && vertex) *vertex = same ? same : v;
    return result;
}

DELAUNAY_API delaunay_result delaunay_editor_insert_vertex(delaunay_editor *editor, uint32_t vertex,
                                                           delaunay_handle hint)
{
    delaunay_result result;
    uint32_t same;
    if (!editor || vertex == DELAUNAY_GHOST || vertex >= editor->mesh->num_vertices ||
        editor->mesh->vertex_tet[vertex])
        return DELAUNAY_ERROR_INVALID_ARGUMENT;
    if (!delaunay__is_finite(editor->mesh->vertices[vertex].x)) return DELAUNAY_ERROR_NOT_FINITE;
    result = delaunay__editor_put(editor, vertex, hint, &same);
    return result == DELAUNAY_OK && same ? DELAUNAY_ERROR_INVALID_ARGUMENT : result;
}

/* Lists the vertices of the star other than v and the ghost, each once, in corners, and their
 * coordinates in xyz. */
static delaunay_result delaunay__editor_corners(delaunay_editor *e, uint32_t v, size_t *num)
{
    delaunay_mesh *mesh = e->mesh;
    delaunay_vertex *x = mesh->vertices;
    size_t i, n = 0, most = 4 * e->star.count;
    int j;
    if (most > e->cap_corners) {
        delaunay_release(&mesh->memory, e->corners);
        delaunay_release(&mesh->memory, e->xyz);
        e->cap_corners = 0;
        e->corners = (uint32_t *)delaunay_alloc(&mesh->memory, 2 * most, sizeof *e->corners);
        e->xyz = (double *)delaunay_alloc(&mesh->memory, 2 * most, 3 * sizeof *e->xyz);
        if (!e->corners || !e->xyz) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        e->cap_corners = 2 * most;
    }
    for (i = 0; i < e->star.count; i++)
        for (j = 0; j < 4; j++) x[mesh->tets[e->star.items[i]].v[j]].local = 0;
    x[v].local = x[DELAUNAY_GHOST].local = 1;
    for (i = 0; i < e->star.count; i++)
        for (j = 0; j < 4; j++) {
            uint32_t w = mesh->tets[e->star.items[i]].v[j];
            if (x[w].local) continue;
            x[w].local = 1;
            e->corners[n] = w;
            memcpy(e->xyz + 3 * n++, x[w].x, 3 * sizeof *e->xyz);
        }
    for (i = 0; i < n; i++) x[e->corners[i]].local = 0;
    x[v].local = x[DELAUNAY_GHOST].local = 0;
    *num = n;
    return DELAUNAY_OK;
}

static delaunay_result delaunay__editor_reserve_tets(delaunay_editor *e, size_t count)
{
    delaunay_memory *m = &e->mesh->memory;
    if (count <= e->cap_tets) return DELAUNAY_OK;
    delaunay_release(m, e->tets);
    delaunay_release(m, e->slots);
    e->cap_tets = 0;
    e->tets = (uint32_t *)delaunay_alloc(m, 2 * count, 4 * sizeof *e->tets);
    e->slots = (delaunay_handle *)delaunay_alloc(m, 2 * count, sizeof *e->slots);
    if (!e->tets || !e->slots) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    e->cap_tets = 2 * count;
    return DELAUNAY_OK;
}

/* Enters the walls of the hole into the worker's table: the facets opposite v, oriented as those of
 * a tetrahedron inside the hole. */
static delaunay_result delaunay__editor_walls(delaunay_editor *e, uint32_t v)
{
    size_t i;
    delaunay_result result = delaunay__replace_scratch(e->worker, 1, e->star.count);
    for (i = 0; result == DELAUNAY_OK && i < e->star.count; i++) {
        const delaunay_tet *t = &e->mesh->tets[e->star.items[i]];
        const uint8_t *o = delaunay_facet_order(delaunay_local_index(t, v));
        uint32_t a = t->v[o[0]], b = t->v[o[1]], c = t->v[o[2]];
        delaunay__face *f = delaunay__face_entry(e->worker, a, b, c);
        f->state = DELAUNAY__FACE_WALL;
        f->odd = delaunay__odd(a, b, c);
    }
    return result;
}

/* Vertex j of tetrahedron t of the corners' triangulation (little), as a vertex of the mesh. */
static uint32_t delaunay__editor_vertex(const delaunay_editor *e, const delaunay_mesh *little,
                                        delaunay_handle t, int j)
{
    uint32_t v = little->tets[t].v[j];
    return v == DELAUNAY_GHOST ? DELAUNAY_GHOST : e->corners[little->vertex_id[v]];
}

/* The wall with the vertices of facet i of t, or NULL; *odd: the orientation of the facet. */
static const delaunay__face *delaunay__editor_wall(const delaunay_editor *e,
                                                   const delaunay_mesh *little, delaunay_handle t,
                                                   int i, uint8_t *odd)
{
    const uint8_t *o = delaunay_facet_order(i);
    uint32_t a = delaunay__editor_vertex(e, little, t, o[0]);
    uint32_t b = delaunay__editor_vertex(e, little, t, o[1]);
    uint32_t c = delaunay__editor_vertex(e, little, t, o[2]);
    const delaunay__face *f = delaunay__face_find(e->worker, a, b, c);
    *odd = delaunay__odd(a, b, c);
    return f;
}

/* Finds the tetrahedra of the corners' triangulation that are in the hole: they have a wall as a
 * facet, with its orientation, or are reached from such ones without crossing a wall. Copies their
 * vertices, numbered as in the mesh, to tets. */
static delaunay_result delaunay__editor_fill(delaunay_editor *e, delaunay_mesh *little, size_t *num)
{
    delaunay_handle t;
    delaunay_result result = DELAUNAY_OK;
    size_t i;
    int j;
    uint8_t odd;
    e->inside.count = 0;
    for (t = 1; t < little->num_tets; t++) {
        for (j = 0; j < 4 && !delaunay_is_deleted(little, t) && !little->mark[t]; j++) {
            const delaunay__face *f = delaunay__editor_wall(e, little, t, j, &odd);
            if (!f || f->odd != odd) continue;
            little->mark[t] = 1;
            result = delaunay_list_push(&e->inside, t);
            if (result != DELAUNAY_OK) return result;
        }
    }
    for (i = 0; i < e->inside.count; i++)
        for (j = 0; j < 4; j++) {
            t = little->tets[e->inside.items[i]].n[j] >> 2;
            if (little->mark[t] || delaunay__editor_wall(e, little, e->inside.items[i], j, &odd))
                continue;
            little->mark[t] = 1;
            result = delaunay_list_push(&e->inside, t);
            if (result != DELAUNAY_OK) return result;
        }
    result = delaunay__editor_reserve_tets(e, e->inside.count);
    for (i = 0; result == DELAUNAY_OK && i < e->inside.count; i++)
        for (j = 0; j < 4; j++)
            e->tets[4 * i + (size_t)j] = delaunay__editor_vertex(e, little, e->inside.items[i], j);
    *num = e->inside.count;
    return result;
}

/* If all corners lie in one plane: the facets opposite v become hull facets, with a ghost on each
 * in place of the star. It is an error if there are no tetrahedra beyond them, as then all
 * remaining vertices lie in the plane. */
static delaunay_result delaunay__editor_cap(delaunay_editor *e, uint32_t v, size_t *num)
{
    size_t i, n = 0;
    delaunay_result result = delaunay__editor_reserve_tets(e, e->star.count);
    for (i = 0; result == DELAUNAY_OK && i < e->star.count; i++) {
        const delaunay_tet *t = &e->mesh->tets[e->star.items[i]];
        int j = delaunay_local_index(t, v);
        const uint8_t *o = delaunay_facet_order(j);
        if (t->v[3] == DELAUNAY_GHOST) continue;
        if (delaunay_is_ghost(e->mesh, t->n[j] >> 2)) return DELAUNAY_ERROR_DIMENSION;
        e->tets[4 * n] = t->v[o[0]];
        e->tets[4 * n + 1] = t->v[o[2]];
        e->tets[4 * n + 2] = t->v[o[1]];
        e->tets[4 * n++ + 3] = DELAUNAY_GHOST;
    }
    *num = n;
    return result;
}

/* The colour of the first ghost of the star, or of the first tetrahedron that is none. */
static uint32_t delaunay__editor_color(const delaunay_editor *e, int ghost)
{
    const delaunay_mesh *mesh = e->mesh;
    size_t i;
    for (i = 0; mesh->color && i < e->star.count; i++)
        if (!delaunay_is_ghost(mesh, e->star.items[i]) == !ghost)
            return mesh->color[e->star.items[i]];
    return DELAUNAY_OUTSIDE;
}

/* Puts the listed tetrahedra in place of the star. */
static delaunay_result delaunay__editor_replace_star(delaunay_editor *e, size_t num)
{
    delaunay_mesh *mesh = e->mesh;
    const uint32_t real = delaunay__editor_color(e, 0), ghost = delaunay__editor_color(e, 1);
    delaunay_result result = delaunay_replace(mesh, e->worker, e->star.items, e->star.count,
                                              e->tets, num, e->slots);
    size_t i;
    for (i = 0; result == DELAUNAY_OK && mesh->color && i < num; i++)
        mesh->color[e->slots[i]] = delaunay_is_ghost(mesh, e->slots[i]) ? ghost : real;
    return result;
}

DELAUNAY_API delaunay_result delaunay_editor_remove(delaunay_editor *editor, uint32_t vertex)
{
    delaunay_mesh little;
    delaunay_options options;
    delaunay_report report;
    delaunay_result result;
    size_t num_corners = 0, num = 0;
    if (!editor || vertex == DELAUNAY_GHOST || vertex >= editor->mesh->num_vertices ||
        !editor->mesh->vertex_tet[vertex])
        return DELAUNAY_ERROR_INVALID_ARGUMENT;
    memset(&little, 0, sizeof little);
    memset(&options, 0, sizeof options);
    options.any_order = 1;
    options.host.num_threads = 1;
    options.host.allocator.alloc = delaunay__counted_alloc;
    options.host.allocator.release = delaunay__counted_release;
    options.host.allocator.user = &editor->mesh->memory;
    result = delaunay_vertex_star(editor->mesh, editor->worker, vertex, &editor->star);
    if (result == DELAUNAY_OK) result = delaunay__editor_corners(editor, vertex, &num_corners);
    if (result != DELAUNAY_OK) return result;
    result = delaunay_tetrahedralize(&little, editor->xyz, num_corners, &options, &report);
    if (result == DELAUNAY_ERROR_DIMENSION) {
        result = delaunay__editor_cap(editor, vertex, &num);
    } else if (result == DELAUNAY_OK) {
        result = delaunay__editor_walls(editor, vertex);
        if (result == DELAUNAY_OK) result = delaunay__editor_fill(editor, &little, &num);
        delaunay_mesh_free(&little);
    }
    if (result != DELAUNAY_OK) return result;
    return delaunay__editor_replace_star(editor, num);
}

/* ---- >>queries  hull, Voronoi cells, alpha values, nearest vertex ---------------------------- */

/* Checks the mesh, and initialises a result's memory with the host's allocator or the default. */
static delaunay_result delaunay__query_begin(const delaunay_mesh *mesh, const delaunay_host *host,
                                             delaunay_memory *memory)
{
    if (!mesh || !mesh->tets || !delaunay__is_closed(mesh)) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    return delaunay_memory_init(memory, host);
}

DELAUNAY_API void delaunay_hull_free(delaunay_hull *hull)
{
    if (!hull) return;
    if (hull->memory.allocator.release) {
        delaunay_release(&hull->memory, hull->facets);
        delaunay_release(&hull->memory, hull->facet_polygon);
        delaunay_release(&hull->memory, hull->polygon_begin);
        delaunay_release(&hull->memory, hull->polygon_vertices);
    }
    memset(hull, 0, sizeof *hull);
}

/* Scratch for the hull. Hull facet f is the one of ghost ghosts[f]; its edge i is opposite its
 * vertex i. A side is an edge between facets of two polygons, given as 3*f + i. */
typedef struct delaunay__shell {
    delaunay_handle *ghosts, *number; /* number[slot of a ghost]: its facet */
    size_t *queue; /* of facets; later the sides that the polygons are traced from */
} delaunay__shell;

/* The hull facet on the other side of edge i of facet f. */
static size_t delaunay__shell_across(const delaunay__shell *s, const delaunay_mesh *mesh, size_t f,
                                     int i)
{
    return s->number[mesh->tets[s->ghosts[f]].n[i] >> 2];
}

/* True if facet f and the one beyond its edge i are coplanar. */
static int delaunay__shell_is_flat(const delaunay__shell *s, const delaunay_mesh *mesh, size_t f,
                                   int i)
{
    const delaunay_tet *t = &mesh->tets[s->ghosts[f]];
    delaunay_handle n = t->n[i];
    const delaunay_vertex *x = mesh->vertices;
    return delaunay_orient3d(x[t->v[0]].x, x[t->v[1]].x, x[t->v[2]].x,
                             x[mesh->tets[n >> 2].v[n & 3]].x) == 0;
}

/* Assigns the next polygon number to facet f and to all facets that make up a polygon with it. */
static void delaunay__shell_flood(delaunay__shell *s, const delaunay_mesh *mesh,
                                  delaunay_hull *hull, size_t f)
{
    size_t head = 0, tail = 0;
    int i;
    hull->facet_polygon[f] = (uint32_t)hull->num_polygons;
    s->queue[tail++] = f;
    while (head < tail) {
        f = s->queue[head++];
        for (i = 0; i < 3; i++) {
            size_t g = delaunay__shell_across(s, mesh, f, i);
            if (hull->facet_polygon[g] != UINT32_MAX || !delaunay__shell_is_flat(s, mesh, f, i))
                continue;
            hull->facet_polygon[g] = (uint32_t)hull->num_polygons;
            s->queue[tail++] = g;
        }
    }
}

/* The local index of vertex v in facet f, which has it. */
static int delaunay__shell_corner(const delaunay_hull *hull, size_t f, uint32_t v)
{
    return hull->facets[3 * f] == v ? 0 : hull->facets[3 * f + 1] == v ? 1 : 2;
}

/* Writes the vertices of the polygon of facet f to polygon_vertices from end on, beginning with
 * side i of f. The next side is found by turning around the vertex where the last one ends. Returns
 * the new end. */
static size_t delaunay__shell_trace(const delaunay__shell *s, const delaunay_mesh *mesh,
                                    delaunay_hull *hull, size_t f, int i, size_t end)
{
    const uint32_t polygon = hull->facet_polygon[f];
    const uint32_t first = hull->facets[3 * f + (size_t)(i + 1) % 3];
    do {
        uint32_t turn = hull->facets[3 * f + (size_t)(i + 2) % 3];
        hull->polygon_vertices[end++] = hull->facets[3 * f + (size_t)(i + 1) % 3];
        i = (i + 1) % 3; /* the edge that begins at turn */
        for (;;) {
            size_t g = delaunay__shell_across(s, mesh, f, i);
            if (hull->facet_polygon[g] != polygon) break;
            f = g;
            i = (delaunay__shell_corner(hull, f, turn) + 2) % 3;
        }
    } while (hull->facets[3 * f + (size_t)(i + 1) % 3] != first);
    return end;
}

static void delaunay__shell_polygons(delaunay__shell *s, const delaunay_mesh *mesh,
                                     delaunay_hull *hull)
{
    size_t f, end = 0, p, *side = s->queue; /* of each polygon one side; the queue is free then */
    int i;
    for (f = 0; f < hull->num_facets; f++) {
        if (hull->facet_polygon[f] != UINT32_MAX) continue;
        delaunay__shell_flood(s, mesh, hull, f);
        hull->num_polygons++;
    }
    for (f = 0; f < hull->num_facets; f++) /* not every facet of a polygon has a side */
        for (i = 0; i < 3; i++) {
            p = hull->facet_polygon[f];
            if (hull->facet_polygon[delaunay__shell_across(s, mesh, f, i)] != p)
                side[p] = 3 * f + (size_t)i;
        }
    for (p = 0; p < hull->num_polygons; p++) {
        hull->polygon_begin[p] = end;
        end = delaunay__shell_trace(s, mesh, hull, side[p] / 3, (int)(side[p] % 3), end);
    }
    hull->polygon_begin[hull->num_polygons] = end;
}

DELAUNAY_API delaunay_result delaunay_hull_of(delaunay_hull *hull, const delaunay_mesh *mesh,
                                              const delaunay_host *host)
{
    delaunay__shell s;
    delaunay_memory *m;
    delaunay_handle t;
    size_t n = 0;
    delaunay_result result;
    if (!hull) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    delaunay_hull_free(hull);
    m = &hull->memory;
    result = delaunay__query_begin(mesh, host, m);
    if (result != DELAUNAY_OK) return result;
    for (t = 1; t < mesh->num_tets; t++)
        n += !delaunay_is_deleted(mesh, t) && delaunay_is_ghost(mesh, t);
    s.ghosts = (delaunay_handle *)delaunay_alloc(m, n, sizeof *s.ghosts);
    s.number = (delaunay_handle *)delaunay_alloc(m, mesh->num_tets, sizeof *s.number);
    s.queue = (size_t *)delaunay_alloc(m, n, sizeof *s.queue);
    hull->facets = (uint32_t *)delaunay_alloc(m, n, 3 * sizeof *hull->facets);
    hull->facet_polygon = (uint32_t *)delaunay_alloc(m, n, sizeof *hull->facet_polygon);
    hull->polygon_begin = (size_t *)delaunay_alloc(m, n + 1, sizeof *hull->polygon_begin);
    hull->polygon_vertices = (uint32_t *)delaunay_alloc(m, n, 3 * sizeof *hull->polygon_vertices);
    if (!s.ghosts || !s.number || !s.queue || !hull->facets || !hull->facet_polygon ||
        !hull->polygon_begin || !hull->polygon_vertices) {
        result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    } else {
        memset(hull->facet_polygon, 0xff, n * sizeof *hull->facet_polygon);
        for (t = 1; t < mesh->num_tets; t++) {
            if (delaunay_is_deleted(mesh, t) || !delaunay_is_ghost(mesh, t)) continue;
            memcpy(hull->facets + 3 * hull->num_facets, mesh->tets[t].v, 3 * sizeof(uint32_t));
            s.number[t] = (delaunay_handle)hull->num_facets;
            s.ghosts[hull->num_facets++] = t;
        }
        delaunay__shell_polygons(&s, mesh, hull);
    }
    delaunay_release(m, s.ghosts);
    delaunay_release(m, s.number);
    delaunay_release(m, s.queue);
    if (result != DELAUNAY_OK) delaunay_hull_free(hull);
    return result;
}

/* -- spheres in rounded arithmetic */

static void delaunay__cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static double delaunay__dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* d = (p - q) / 2^e, with e such that the largest component of d is in [0.5, 1), or e = 0 if p = q.
 * Returns e. */
static DELAUNAY__NOINLINE int delaunay__extreme_difference(const double *p, const double *q,
                                                           double *d)
{
    double most = 0;
    int k, e = 0, half = 0;
    for (k = 0; k < 3; k++) half |= !(fabs(p[k] - q[k]) <= DBL_MAX);
    for (k = 0; k < 3; k++) {
        d[k] = half ? p[k] / 2 - q[k] / 2 : p[k] - q[k];
        if (fabs(d[k]) > most) most = fabs(d[k]);
    }
    (void)frexp(most, &e);
    for (k = 0; k < 3; k++) d[k] = ldexp(d[k], -e);
    return e + half;
}

/* d = (p - q) / 2^e, scaled such that products of six components of such differences stay far from
 * overflow and underflow. Returns e, which is 0 at all but extreme scales. */
DELAUNAY_INLINE int delaunay__scaled_difference(const double *p, const double *q, double *d)
{
    const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    const double sum = fabs(x) + fabs(y) + fabs(z);
    if (!(sum >= 1e-30 && sum <= 1e30)) return delaunay__extreme_difference(p, q, d);
    d[0] = x;
    d[1] = y;
    d[2] = z;
    return 0;
}

/* A sphere through vertices of a mesh. radius2, the squared radius, is in units of 4^e, where e is
 * 0 at all but extreme scales. */
typedef struct delaunay__sphere {
    double center[3], radius2;
    int    e;
} delaunay__sphere;

/* The smallest sphere through two, three or four points or, with weights (w not NULL), orthogonal
 * to the spheres of the points. Each difference u[i] has a unit of its own, 2^unit[i]; these units
 * are a common factor of all terms of each sum below. The result is in the largest of them. */
static void delaunay__smallest_sphere(const double *const *p, const double *w, int count,
                                      delaunay__sphere *sphere)
{
    double u[3][3], c[3][3], lift[3], x[3], scale = 0;
    int unit[3], most = INT_MIN, i, k;
    for (i = 0; i + 1 < count; i++) {
        unit[i] = delaunay__scaled_difference(p[i + 1], p[0], u[i]);
        if (unit[i] > most) most = unit[i];
    }
    for (i = 0; i + 1 < count; i++) { /* in units of 2^(unit[i] + most) */
        lift[i] = delaunay__dot(u[i], u[i]);
        if (unit[i] != most) lift[i] = ldexp(lift[i], unit[i] - most);
        if (w) lift[i] += ldexp(w[0] - w[i + 1], -unit[i] - most);
    }
    if (count == 2) {
        memcpy(c[0], u[0], sizeof c[0]);
        scale = delaunay__dot(u[0], u[0]);
    } else if (count == 3) {
        delaunay__cross(u[0], u[1], u[2]);
        delaunay__cross(u[1], u[2], c[0]);
        delaunay__cross(u[2], u[0], c[1]);
        scale = delaunay__dot(u[2], u[2]);
    } else {
        for (i = 0; i < 3; i++) delaunay__cross(u[(i + 1) % 3], u[(i + 2) % 3], c[i]);
        scale = delaunay__dot(u[0], c[0]);
    }
    for (k = 0; k < 3; k++) {
        for (x[k] = 0, i = 0; i + 1 < count; i++) x[k] += lift[i] * c[i][k];
        x[k] /= 2 * scale;
        sphere->center[k] = p[0][k] + (most ? ldexp(x[k], most) : x[k]);
    }
    sphere->radius2 = delaunay__dot(x, x) - (w ? ldexp(w[0], -2 * most) : 0);
    sphere->e = most;
}

/* The vertex with the least sum of distances from the others. */
static int delaunay__middle_of(const delaunay_mesh *mesh, const uint32_t *v, int count)
{
    double least = HUGE_VAL;
    int i, j, k, middle = 0;
    for (i = 0; i < count; i++) {
        const double *x = mesh->vertices[v[i]].x;
        double sum = 0;
        for (j = 0; j < count; j++)
            for (k = 0; k < 3; k++) sum += fabs(x[k] - mesh->vertices[v[j]].x[k]);
        if (sum >= least) continue;
        least = sum;
        middle = i;
    }
    return middle;
}

/* The same for vertices of a mesh. Returns the squared radius in the units of the mesh. The origin
 * is near most vertices, as differences of long vectors would lose what is short. */
static double delaunay__sphere_of(const delaunay_mesh *mesh, const uint32_t *v, int count,
                                  delaunay__sphere *sphere)
{
    const int middle = delaunay__middle_of(mesh, v, count);
    const double *p[4];
    double w[4];
    int i;
    for (i = 0; i < count; i++) {
        const uint32_t u = v[i == 0 ? middle : i == middle ? 0 : i];
        p[i] = mesh->vertices[u].x;
        if (mesh->weight) w[i] = mesh->weight[u];
    }
    delaunay__smallest_sphere(p, mesh->weight ? w : NULL, count, sphere);
    return sphere->e ? ldexp(sphere->radius2, 2 * sphere->e) : sphere->radius2;
}

static int delaunay__is_in_sphere(const delaunay_mesh *mesh, const delaunay__sphere *sphere,
                                  uint32_t v)
{
    double d[3], weight = 0;
    int k;
    if (v == DELAUNAY_GHOST) return 0;
    if (mesh->weight) weight = mesh->weight[v];
    for (k = 0; k < 3; k++) d[k] = mesh->vertices[v].x[k] - sphere->center[k];
    if (sphere->e) {
        for (k = 0; k < 3; k++) d[k] = ldexp(d[k], -sphere->e);
        weight = ldexp(weight, -2 * sphere->e);
    }
    return delaunay__dot(d, d) - weight < sphere->radius2;
}

/* -- Voronoi */

DELAUNAY_API void delaunay_voronoi_free(delaunay_voronoi *voronoi)
{
    if (!voronoi) return;
    if (voronoi->memory.allocator.release) {
        delaunay_release(&voronoi->memory, voronoi->centers);
        delaunay_release(&voronoi->memory, voronoi->face_cells);
        delaunay_release(&voronoi->memory, voronoi->face_begin);
        delaunay_release(&voronoi->memory, voronoi->face_tets);
        delaunay_release(&voronoi->memory, voronoi->cell_begin);
        delaunay_release(&voronoi->memory, voronoi->cell_faces);
    }
    memset(voronoi, 0, sizeof *voronoi);
}

static void delaunay__center(const delaunay_mesh *mesh, delaunay_handle t, double *center)
{
    static const double zero[3] = {0, 0, 0};
    delaunay__sphere sphere;
    const double *p[3];
    double u[3], v[3], normal[3], length;
    int k;
    if (!delaunay_is_ghost(mesh, t)) {
        (void)delaunay__sphere_of(mesh, mesh->tets[t].v, 4, &sphere);
        memcpy(center, sphere.center, sizeof sphere.center);
        return;
    }
    for (k = 0; k < 3; k++) p[k] = delaunay__corner(mesh, t, k);
    (void)delaunay__scaled_difference(p[1], p[0], u);
    (void)delaunay__scaled_difference(p[2], p[0], v);
    delaunay__cross(u, v, normal);
    (void)delaunay__scaled_difference(normal, zero, center);
    length = sqrt(delaunay__dot(center, center));
    for (k = 0; k < 3 && length > 0; k++) center[k] /= length;
}

/* The state of a turn around an edge: a tetrahedron, and its two vertices that are not on the edge;
 * the next step crosses the facet opposite leave (see delaunay__turn). */
typedef struct delaunay__turning {
    delaunay_handle t;
    uint32_t leave, keep;
} delaunay__turning;

/* The start, at t, of a turn around its edge e, counterclockwise as seen from the greater vertex of
 * the edge. */
static delaunay__turning delaunay__turning_at(const delaunay_mesh *mesh, delaunay_handle t, int e)
{
    static const uint8_t others[6][2] = {{2, 3}, {3, 1}, {1, 2}, {0, 3}, {2, 0}, {0, 1}};
    const uint32_t *v = mesh->tets[t].v;
    int swap = v[delaunay_edge_order(e)[0]] > v[delaunay_edge_order(e)[1]];
    delaunay__turning r;
    r.t = t;
    r.leave = v[others[e][swap]];
    r.keep = v[others[e][1 - swap]];
    return r;
}

/* If t is the lowest slot around its edge e, returns the number of corners of the Voronoi face of
 * that edge, and in *r where the face begins: at t, or for a hull edge at the second of its two
 * ghosts. Otherwise returns 0. */
static size_t delaunay__face_start(const delaunay_mesh *mesh, delaunay_handle t, int e,
                                   delaunay__turning *r)
{
    delaunay__turning at = delaunay__turning_at(mesh, t, e);
    size_t n = 0;
    *r = at;
    do {
        int ghost = delaunay_is_ghost(mesh, at.t);
        delaunay__turn(mesh, &at.t, &at.leave, &at.keep);
        if (at.t < t) return 0;
        if (ghost && delaunay_is_ghost(mesh, at.t)) *r = at;
        n++;
    } while (at.t != t);
    return n;
}

/* Fills the arrays of faces and their corners, or only counts the faces if the arrays are NULL. */
static void delaunay__voronoi_faces(delaunay_voronoi *voronoi, const delaunay_mesh *mesh)
{
    delaunay_handle t;
    size_t n, i, faces = 0, corners = 0;
    int e;
    for (t = 1; t < mesh->num_tets; t++)
        for (e = 0; e < 6 && !delaunay_is_deleted(mesh, t); e++) {
            uint32_t a = mesh->tets[t].v[delaunay_edge_order(e)[0]];
            uint32_t b = mesh->tets[t].v[delaunay_edge_order(e)[1]];
            delaunay__turning r;
            if (b == DELAUNAY_GHOST || !(n = delaunay__face_start(mesh, t, e, &r))) continue;
            if (voronoi->face_cells) {
                voronoi->face_cells[2 * faces] = a < b ? a : b;
                voronoi->face_cells[2 * faces + 1] = a < b ? b : a;
                voronoi->face_begin[faces] = corners;
                for (i = 0; i < n; i++) {
                    voronoi->face_tets[corners + i] = r.t;
                    delaunay__turn(mesh, &r.t, &r.leave, &r.keep);
                }
            }
            faces++;
            corners += n;
        }
    voronoi->num_faces = faces;
    if (voronoi->face_cells) voronoi->face_begin[faces] = corners;
}

/* Lists the faces of each cell in ascending order, by a counting sort. */
static void delaunay__voronoi_cells(delaunay_voronoi *voronoi)
{
    size_t *begin = voronoi->cell_begin, i, sum = 0;
    memset(begin, 0, (voronoi->num_cells + 1) * sizeof *begin);
    for (i = 0; i < 2 * voronoi->num_faces; i++) begin[voronoi->face_cells[i]]++;
    for (i = 0; i <= voronoi->num_cells; i++) {
        size_t count = begin[i];
        begin[i] = sum;
        sum += count;
    }
    for (i = 0; i < 2 * voronoi->num_faces; i++)
        voronoi->cell_faces[begin[voronoi->face_cells[i]]++] = i / 2;
    for (i = voronoi->num_cells; i > 0; i--) begin[i] = begin[i - 1]; /* ends to beginnings */
    begin[0] = 0;
}

DELAUNAY_API delaunay_result delaunay_voronoi_of(delaunay_voronoi *voronoi,
                                                 const delaunay_mesh *mesh,
                                                 const delaunay_host *host)
{
    delaunay_memory *m;
    delaunay_handle t;
    size_t corners = 0, faces;
    delaunay_result result;
    if (!voronoi) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    delaunay_voronoi_free(voronoi);
    m = &voronoi->memory;
    result = delaunay__query_begin(mesh, host, m);
    if (result != DELAUNAY_OK) return result;
    for (t = 1; t < mesh->num_tets; t++)
        if (!delaunay_is_deleted(mesh, t)) corners += delaunay_is_ghost(mesh, t) ? 3u : 6u;
    delaunay__voronoi_faces(voronoi, mesh);
    faces = voronoi->num_faces;
    voronoi->num_cells = mesh->num_vertices;
    voronoi->centers = (double *)delaunay_alloc(m, mesh->num_tets, 3 * sizeof(double));
    voronoi->face_begin = (size_t *)delaunay_alloc(m, faces + 1, sizeof(size_t));
    voronoi->face_tets = (delaunay_handle *)delaunay_alloc(m, corners, sizeof(delaunay_handle));
    voronoi->cell_begin = (size_t *)delaunay_alloc(m, voronoi->num_cells + 1, sizeof(size_t));
    voronoi->cell_faces = (size_t *)delaunay_alloc(m, faces, 2 * sizeof(size_t));
    voronoi->face_cells = (uint32_t *)delaunay_alloc(m, faces, 2 * sizeof(uint32_t));
    if (!voronoi->centers || !voronoi->face_begin || !voronoi->face_tets || !voronoi->cell_begin ||
        !voronoi->cell_faces || !voronoi->face_cells) {
        delaunay_voronoi_free(voronoi);
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    memset(voronoi->centers, 0, mesh->num_tets * 3 * sizeof(double));
    for (t = 1; t < mesh->num_tets; t++)
        if (!delaunay_is_deleted(mesh, t)) delaunay__center(mesh, t, voronoi->centers + 3 * t);
    delaunay__voronoi_faces(voronoi, mesh);
    delaunay__voronoi_cells(voronoi);
    return DELAUNAY_OK;
}

/* -- alpha values */

DELAUNAY_API void delaunay_alpha_free(delaunay_alpha *alpha)
{
    if (!alpha) return;
    if (alpha->memory.allocator.release) {
        delaunay_release(&alpha->memory, alpha->tets);
        delaunay_release(&alpha->memory, alpha->facets);
        delaunay_release(&alpha->memory, alpha->edges);
    }
    memset(alpha, 0, sizeof *alpha);
}

/* The alpha value of facet f, from those of the tetrahedra on both sides. */
static double delaunay__alpha_facet(const delaunay_alpha *alpha, const delaunay_mesh *mesh,
                                    delaunay_handle f)
{
    const delaunay_handle side[2] = {f, mesh->tets[f >> 2].n[f & 3]};
    delaunay__sphere sphere;
    double own, least = DBL_MAX;
    uint32_t v[3];
    int i, empty = 1;
    delaunay__get_facet(mesh, f, v);
    own = delaunay__sphere_of(mesh, v, 3, &sphere);
    for (i = 0; i < 2; i++) {
        uint32_t apex = mesh->tets[side[i] >> 2].v[side[i] & 3];
        double value = alpha->tets[side[i] >> 2];
        if (value < least) least = value;
        if (delaunay__is_in_sphere(mesh, &sphere, apex)) empty = 0;
    }
    return empty && own < least ? own : least;
}

/* The alpha value of the edge of a Voronoi face, from those of the facets around the edge. */
static double delaunay__alpha_edge(const delaunay_alpha *alpha, const delaunay_mesh *mesh,
                                   const delaunay_voronoi *voronoi, size_t face)
{
    const uint32_t *ab = voronoi->face_cells + 2 * face;
    delaunay__sphere sphere;
    double own = delaunay__sphere_of(mesh, ab, 2, &sphere), least = DBL_MAX;
    size_t j;
    int i, empty = 1;
    for (j = voronoi->face_begin[face]; j < voronoi->face_begin[face + 1]; j++) {
        delaunay_handle t = voronoi->face_tets[j];
        const uint32_t *v = mesh->tets[t].v;
        for (i = 0; i < 4; i++) {
            if (v[i] == ab[0] || v[i] == ab[1]) continue;
            if (alpha->facets[4 * t + (delaunay_handle)i] < least)
                least = alpha->facets[4 * t + (delaunay_handle)i];
            if (delaunay__is_in_sphere(mesh, &sphere, v[i])) empty = 0;
        }
    }
    return empty && own < least ? own : least;
}

DELAUNAY_API delaunay_result delaunay_alpha_of(delaunay_alpha *alpha, const delaunay_mesh *mesh,
                                               const delaunay_voronoi *voronoi,
                                               const delaunay_host *host)
{
    delaunay_memory *m;
    delaunay_handle t, f;
    size_t i;
    delaunay_result result;
    if (!alpha) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    delaunay_alpha_free(alpha);
    m = &alpha->memory;
    result = delaunay__query_begin(mesh, host, m);
    if (result != DELAUNAY_OK) return result;
    if (!voronoi || voronoi->num_cells != mesh->num_vertices)
        return DELAUNAY_ERROR_INVALID_ARGUMENT;
    alpha->tets = (double *)delaunay_alloc(m, mesh->num_tets, sizeof(double));
    alpha->facets = (double *)delaunay_alloc(m, mesh->num_tets, 4 * sizeof(double));
    alpha->edges = (double *)delaunay_alloc(m, voronoi->num_faces, sizeof(double));
    if (!alpha->tets || !alpha->facets || !alpha->edges) {
        delaunay_alpha_free(alpha);
        return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    for (t = 0; t < mesh->num_tets; t++) {
        delaunay__sphere sphere;
        int k;
        alpha->tets[t] = DBL_MAX;
        for (k = 0; k < 4; k++) alpha->facets[4 * t + (delaunay_handle)k] = DBL_MAX;
        if (t == 0 || delaunay_is_deleted(mesh, t) || delaunay_is_ghost(mesh, t)) continue;
        alpha->tets[t] = delaunay__sphere_of(mesh, mesh->tets[t].v, 4, &sphere);
        if (!(alpha->tets[t] < DBL_MAX)) alpha->tets[t] = DBL_MAX;
    }
    for (f = 4; f < 4 * mesh->num_tets; f++)
        if (!delaunay_is_deleted(mesh, f >> 2) &&
            (!delaunay_is_ghost(mesh, f >> 2) || (f & 3) == 3)) {
            delaunay_handle g = mesh->tets[f >> 2].n[f & 3];
            alpha->facets[f] = g < f ? alpha->facets[g] : delaunay__alpha_facet(alpha, mesh, f);
        }
    for (i = 0; i < voronoi->num_faces; i++)
        alpha->edges[i] = delaunay__alpha_edge(alpha, mesh, voronoi, i);
    return DELAUNAY_OK;
}

/* -- nearest vertex */

DELAUNAY_API uint32_t delaunay_nearest(const delaunay_mesh *mesh, delaunay_worker *worker,
                                       const double *xyz, delaunay_handle hint)
{
    delaunay_handle t = delaunay_locate(mesh, xyz, hint);
    uint32_t best, before;
    size_t i;
    int k;
    if (t == DELAUNAY_NONE || !mesh->vertex_tet || mesh->weight) return 0;
    best = mesh->tets[t].v[0];
    do {
        before = best;
        if (delaunay_vertex_star(mesh, worker, before, &worker->queue) != DELAUNAY_OK) return 0;
        for (i = 0; i < worker->queue.count; i++)
            for (k = 0; k < 4; k++) {
                uint32_t v = mesh->tets[worker->queue.items[i]].v[k];
                if (v != DELAUNAY_GHOST && v != best &&
                    delaunay_compare_distance(xyz, mesh->vertices[v].x, mesh->vertices[best].x) < 0)
                    best = v;
            }
    } while (best != before);
    return best;
}

/* ---- >>reconnect  closure search over small polyhedra [Marot 2020, 6.2] --------------------- */
/* Closure search: the front is the set of oriented triangles that still wait for a tetrahedron on
 * their inner side; at first the boundary of the window, at last empty. A step takes a triangle abc
 * of the front and one of the window's vertices p with orient3d(a,b,c,p) > 0; abc leaves the front,
 * and each of abp, bcp, cap either cancels its opposite there or joins it.
 *
 * Why no intersection test is needed. Let t_1 .. t_n be positive tetrahedra whose oriented
 * boundaries add up to that of the polyhedron P, as chains: triangles cancel in opposite pairs, and
 * what is left is exactly the boundary of P. The sum of the indicator functions of the t_i minus
 * that of P is then constant across every triangle and zero far away: zero almost everywhere. So
 * the t_i cover P, each point once. Neighbours share whole triangles, because what cancels are
 * triples of vertices. The same argument in the sphere of directions around a vertex v that is
 * used, or that lies on the boundary, says that the tetrahedra at v fill the neighbourhood of v in
 * P; so v lies in no other tetrahedron. What remains to be checked at the end: that every interior
 * vertex is used (else a tetrahedron may have swallowed it, and all volumes would still match), and
 * every kept edge. A kept facet joins the front at the beginning, once in each orientation: the two
 * cancel in the sum, so the argument holds, and each side must get a tetrahedron. Preconditions:
 * exact signs; the window's tetrahedra are disjoint and not ghosts.
 *
 * Everything else only prunes the search: the triangle with the fewest candidates is closed first;
 * a triangle without candidates ends a branch; triangles crossed by a kept edge, edges through a
 * kept facet and tetrahedra that contain an interior vertex are never made. The candidates of a
 * triangle are a bit mask in one word. Signs are computed for all vertices against the plane of a
 * triangle at once. They stay valid for later windows as far as these begin with the same vertices,
 * as the windows of a growing cavity do; so do qualities that are computed one by one.
 *
 * A triangle of local vertices i < j < k has the number C(k,3) + C(j,2) + i: the triangles of the
 * first m vertices have the numbers below C(m,3), so small windows touch little memory. The number
 * of an oriented triangle is twice that, plus 1 if its orientation is that of k, j, i. */
enum {
    DELAUNAY__MAX_POINTS = DELAUNAY_WINDOW_VERTICES,
    DELAUNAY__NUM_PAIRS = 496,    /* C(32,2) */
    DELAUNAY__NUM_TRIPLES = 4960, /* C(32,3) */
    DELAUNAY__NUM_QUADS = 35960,  /* C(32,4) */
    DELAUNAY__MAX_FRONT = 2048,
    DELAUNAY__DEAD_BITS = 13,
    DELAUNAY__DEFAULT_NODES = 100000
};

/* What is known about the vertices p beside a triangle i < j < k, as bit masks: the sign of
 * orient3d(i,j,k,p) is known; is 1; is -1. measured: p > k, and the quality of ijkp is known. */
typedef struct delaunay__sides {
    uint32_t known, positive, negative, measured;
} delaunay__sides;

/* The candidates of an oriented triangle; valid in the search, and under the bound, that this stamp
 * stands for. */
typedef struct delaunay__choice {
    uint32_t stamp, mask; /* mask: bits of the candidates */
    double   top;         /* the best quality of their tetrahedra */
} delaunay__choice;

/* The vertices that a pair of vertices, or a single one, must not be joined to; valid in the search
 * with this number. */
typedef struct delaunay__barred {
    uint32_t search, known, crossed; /* known: bits of vertices tested; crossed: the barred ones */
} delaunay__barred;

/* A front that cannot be completed. Whether it can depends on the front alone, not on how it was
 * reached. */
typedef struct delaunay__dead_end {
    uint64_t front;  /* its key, see delaunay__front_key, plus that of the search */
    uint32_t budget; /* it failed with this number of crossings or bad tetrahedra left to spend */
    float    weight; /* and with this weight left, rounded to a float */
} delaunay__dead_end;

/* Totals over the tetrahedra on the stack. */
typedef struct delaunay__tally {
    double   worst, weight; /* the worst quality; the weight of the bad tetrahedra */
    uint32_t cost;          /* the number of crossings or of bad tetrahedra */
} delaunay__tally;

/* A search works on local vertices 0 .. 31 of its window. A pair a < b has the number C(b,2) + a,
 * a quadruple i < j < k < l the number C(l,4) + C(k,3) + C(j,2) + i. */
struct delaunay__search_tables {
    /* constant */
    uint64_t random[2 * DELAUNAY__NUM_TRIPLES]; /* of oriented triangles; sums are keys of fronts */
    uint8_t  triangle[DELAUNAY__NUM_TRIPLES][4];
    uint32_t choose1[DELAUNAY__MAX_POINTS + 1]; /* binomial coefficients */
    uint32_t choose2[DELAUNAY__MAX_POINTS + 1];
    uint32_t choose3[DELAUNAY__MAX_POINTS + 1], choose4[DELAUNAY__MAX_POINTS + 1];
    /* kept from search to search as long as the points are the same */
    double         x[DELAUNAY__MAX_POINTS][3];
    double         axis[3][DELAUNAY__MAX_POINTS]; /* the same, by axis */
    uint32_t       num_known;
    double (*known_quality)(void *, const double *, const double *, const double *, const double *);
    void          *known_user;
    delaunay__sides  rows[DELAUNAY__NUM_TRIPLES];
    double         quality[DELAUNAY__NUM_QUADS];
    /* of one search: entries are valid if they have its stamp or number, or are cleared after it */
    delaunay__choice choice[2 * DELAUNAY__NUM_TRIPLES];
    uint32_t stamp;                               /* of choices; raised by a search or new bound */
    uint64_t search_key;                          /* is added to the keys of dead ends */
    uint32_t search;                              /* number of the search, stamp of the next four */
    delaunay__barred barred_pair[DELAUNAY__NUM_PAIRS]; /* triangles that a kept edge crosses */
    delaunay__barred barred_vertex[DELAUNAY__MAX_POINTS]; /* edges that pierce a kept facet */
    uint32_t triple_cost[DELAUNAY__NUM_TRIPLES];  /* 2*search + 1 if the target segment crosses */
    uint32_t pair_cost[DELAUNAY__NUM_PAIRS];      /* 2*search + 1 if it pierces the target facet */
    uint32_t pair_used[DELAUNAY__NUM_PAIRS];      /* number of uses; cleared as far as needed */
    uint16_t place[2 * DELAUNAY__NUM_TRIPLES];    /* 1 + position in the front; 0: not there */
    uint16_t front[DELAUNAY__MAX_FRONT];          /* oriented triangles that need a tetrahedron */
    delaunay__choice waiting[DELAUNAY__MAX_FRONT]; /* copies of their choices, maybe outdated */
    uint16_t valence[DELAUNAY__MAX_POINTS];       /* triangles of the front at a vertex */
    uint32_t num_front, on_front;                 /* on_front: vertices with valence > 0 */
    uint64_t front_sum;                           /* of the random numbers of the front */
    delaunay__dead_end dead[1 << DELAUNAY__DEAD_BITS];
    uint32_t points, interior, used; /* masks: vertices allowed, interior ones, those used so far */
    uint32_t boundary_pairs[DELAUNAY__MAX_POINTS]; /* row a, bit b: edge ab is on the boundary */
    uint32_t depth;
    uint8_t  stack[DELAUNAY_WINDOW_TETS][4];
    const delaunay_mesh   *mesh;
    const delaunay_window *window;
    delaunay_search       *out;
    delaunay_objective     objective;
    int      measures; /* the objective is one of quality */
    int      counts_pairs; /* there are kept edges, or crossing edges are counted */
    int      at_once;  /* the qualities of all candidates of a triangle are computed together */
    int      simd;     /* the processor has AVX2 */
    double   best; /* every tetrahedron must be better than this */
    double   max_weight;
    uint32_t cost_bound, flags; /* the cost of a result must be below cost_bound */
    int      counts_bad; /* the cost is the number of bad tetrahedra */
    int      found;
};

static size_t delaunay__size_of_tables(void) { return sizeof(delaunay__search_tables); }

/* Prepares tables for their first search. It takes a while, and most workers never search. */
static void delaunay__tables_init(delaunay__search_tables *s)
{
    /* what comes before, and is kept from search to search, is valid as far as num_known says */
    const size_t from = offsetof(delaunay__search_tables, choice);
    uint32_t i, j, k, r = 0;
    memset((char *)s + from, 0, sizeof *s - from);
    s->num_known = 0;
    s->known_quality = NULL;
    s->known_user = NULL;
    for (i = 0; i <= DELAUNAY__MAX_POINTS; i++) {
        s->choose1[i] = i;
        s->choose2[i] = i * (i - (i > 0)) / 2;
        s->choose3[i] = i < 3 ? 0 : i * (i - 1) * (i - 2) / 6;
        s->choose4[i] = i < 4 ? 0 : i * (i - 1) * (i - 2) / 6 * (i - 3) / 4;
    }
    for (k = 0; k < DELAUNAY__MAX_POINTS; k++)
        for (j = 0; j < k; j++)
            for (i = 0; i < j; i++, r++) {
                s->triangle[r][0] = (uint8_t)i;
                s->triangle[r][1] = (uint8_t)j;
                s->triangle[r][2] = (uint8_t)k;
            }
#if defined(DELAUNAY__AVX2)
    s->simd = DELAUNAY__AVX2;
#endif
    for (i = 0; i < 2 * DELAUNAY__NUM_TRIPLES; i++)
        s->random[i] = delaunay__mix((i + 1) * UINT64_C(0x9E3779B97F4A7C15));
}

/* The number of oriented triangle abc; sorts the vertices without branches. */
static uint32_t delaunay__oriented(const delaunay__search_tables *s, uint32_t a, uint32_t b,
                                   uint32_t c)
{
    uint32_t lo = a < b ? a : b, hi = a < b ? b : a, low = lo < c ? lo : c, high = hi > c ? hi : c;
    uint32_t mid = a + b + c - low - high;
    return 2 * (s->choose3[high] + s->choose2[mid] + low) +
           ((uint32_t)(a > b) ^ (uint32_t)(a > c) ^ (uint32_t)(b > c));
}

static void delaunay__oriented_vertices(const delaunay__search_tables *s, uint32_t id, uint32_t *v)
{
    const uint8_t *t = s->triangle[id / 2];
    v[0] = t[0];
    v[1] = t[1 + (id & 1)];
    v[2] = t[2 - (id & 1)];
}

static uint32_t delaunay__pair(const delaunay__search_tables *s, uint32_t a, uint32_t b)
{
    return a < b ? s->choose2[b] + a : s->choose2[a] + b;
}

static uint32_t delaunay__popcount(uint32_t x)
{
    x = x - ((x >> 1) & 0x55555555u);
    x = (x & 0x33333333u) + ((x >> 2) & 0x33333333u);
    return (((x + (x >> 4)) & 0x0f0f0f0fu) * 0x01010101u) >> 24;
}

DELAUNAY__ALWAYS_INLINE uint32_t delaunay__count_bits(uint32_t x, const int has_popcount)
{
#if defined(__GNUC__)
    if (has_popcount) return (uint32_t)__builtin_popcount(x);
#endif
    (void)has_popcount;
    return delaunay__popcount(x);
}

static uint32_t delaunay__lowest(uint32_t x)
{
#if defined(__GNUC__)
    return (uint32_t)__builtin_ctz(x);
#else
    return delaunay__popcount((x & (0u - x)) - 1);
#endif
}

static void delaunay__store_sign(delaunay__sides *row, uint32_t p, int sign)
{
    uint32_t bit = 1u << p;
    row->known |= bit;
    if (sign > 0) row->positive |= bit;
    if (sign < 0) row->negative |= bit;
}

/* Computes an exact sign, which is expensive, and stores it for all four triangles of the
 * tetrahedron; the parity of the permutation decides about the sign of each. */
static void delaunay__exact_sign(delaunay__search_tables *s, uint32_t triple, uint32_t p)
{
    const uint8_t *t = s->triangle[triple];
    uint32_t v[4], i;
    int sign;
    for (i = 0; i < 3 && t[i] < p; i++) v[i] = t[i];
    v[i] = p;
    for (; i < 3; i++) v[i + 1] = t[i];
    sign = delaunay_orient3d(s->x[v[0]], s->x[v[1]], s->x[v[2]], s->x[v[3]]);
    delaunay__store_sign(&s->rows[s->choose3[v[2]] + s->choose2[v[1]] + v[0]], v[3], sign);
    delaunay__store_sign(&s->rows[s->choose3[v[3]] + s->choose2[v[1]] + v[0]], v[2], -sign);
    delaunay__store_sign(&s->rows[s->choose3[v[3]] + s->choose2[v[2]] + v[0]], v[1], sign);
    delaunay__store_sign(&s->rows[s->choose3[v[3]] + s->choose2[v[2]] + v[1]], v[0], -sign);
}

/* The plane of a triangle, and the filter of delaunay_orient3d with the determinant expanded along
 * the fourth point: the sign is certain where the square of the determinant exceeds least times the
 * squared distance of the point from x, plus PLANE_LEAST. */
typedef struct delaunay__plane {
    double x[3], normal[3], least; /* x: the first vertex; least is infinite at extreme scales */
} delaunay__plane;
#  define DELAUNAY__PLANE_LEAST 1e-290 /* guards against underflow */

static void delaunay__plane_set(delaunay__plane *plane, const double *a, const double *b,
                                const double *c)
{
    double u[3], v[3], uu, vv;
    int i;
    for (i = 0; i < 3; i++) {
        u[i] = b[i] - a[i];
        v[i] = c[i] - a[i];
        plane->x[i] = a[i];
    }
    for (i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        plane->normal[i] = u[j] * v[k] - u[k] * v[j];
    }
    uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    vv = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    plane->least =
        uu > 1e-90 && vv > 1e-90 && uu < 1e100 && vv < 1e100 ? 2e-30 * uu * vv : HUGE_VAL;
}

/* Those of the wanted vertices that lie on the one and the other side of a plane with certainty. */
static void delaunay__sides_plain(const delaunay__search_tables *s, const delaunay__plane *plane,
                                  uint32_t wanted, uint32_t *positive, uint32_t *negative)
{
    for (*positive = *negative = 0; wanted; wanted &= wanted - 1) {
        uint32_t p = delaunay__lowest(wanted);
        double x = s->x[p][0] - plane->x[0], y = s->x[p][1] - plane->x[1],
               z = s->x[p][2] - plane->x[2];
        double det = plane->normal[0] * x + plane->normal[1] * y + plane->normal[2] * z;
        if (!(det * det > plane->least * (x * x + y * y + z * z) + DELAUNAY__PLANE_LEAST)) continue;
        *(det > 0 ? positive : negative) |= 1u << p;
    }
}

#  if defined(DELAUNAY__AVX2)
/* The same, four vertices at a time. */
DELAUNAY__TARGET static void delaunay__sides_avx2(const delaunay__search_tables *s,
                                                  const delaunay__plane *plane, uint32_t wanted,
                                                  uint32_t *positive, uint32_t *negative)
{
    const __m256d least = _mm256_set1_pd(plane->least), zero = _mm256_setzero_pd();
    uint32_t sure = 0, above = 0, k;
    for (k = 0; k < DELAUNAY__MAX_POINTS && wanted >> k; k += 4) {
        __m256d x, y, z, det, far_;
        if (!(wanted >> k & 15)) continue;
        x = _mm256_sub_pd(_mm256_loadu_pd(s->axis[0] + k), _mm256_set1_pd(plane->x[0]));
        y = _mm256_sub_pd(_mm256_loadu_pd(s->axis[1] + k), _mm256_set1_pd(plane->x[1]));
        z = _mm256_sub_pd(_mm256_loadu_pd(s->axis[2] + k), _mm256_set1_pd(plane->x[2]));
        det = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(x, _mm256_set1_pd(plane->normal[0])),
                                          _mm256_mul_pd(y, _mm256_set1_pd(plane->normal[1]))),
                            _mm256_mul_pd(z, _mm256_set1_pd(plane->normal[2])));
        far_ = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(x, x), _mm256_mul_pd(y, y)),
                             _mm256_mul_pd(z, z));
        far_ = _mm256_add_pd(_mm256_mul_pd(least, far_), _mm256_set1_pd(DELAUNAY__PLANE_LEAST));
        sure |= (uint32_t)_mm256_movemask_pd(
                    _mm256_cmp_pd(_mm256_mul_pd(det, det), far_, _CMP_GT_OQ))
                << k;
        above |= (uint32_t)_mm256_movemask_pd(_mm256_cmp_pd(det, zero, _CMP_GT_OQ)) << k;
    }
    *positive = wanted & sure & above;
    *negative = wanted & sure & ~above;
}
#  endif

/* Computes the signs of these vertices, none of which is known. */
static DELAUNAY__NOINLINE void delaunay__find_sides(delaunay__search_tables *s, uint32_t triple,
                                                    uint32_t missing)
{
    const uint8_t *t = s->triangle[triple];
    delaunay__sides *row = &s->rows[triple];
    delaunay__plane plane;
    uint32_t positive, negative;
    delaunay__plane_set(&plane, s->x[t[0]], s->x[t[1]], s->x[t[2]]);
#  if defined(DELAUNAY__AVX2)
    if (s->simd) delaunay__sides_avx2(s, &plane, missing, &positive, &negative);
    else
#  endif
        delaunay__sides_plain(s, &plane, missing, &positive, &negative);
    row->known |= positive | negative;
    row->positive |= positive;
    row->negative |= negative;
    for (missing &= ~row->known; missing; missing &= missing - 1)
        delaunay__exact_sign(s, triple, delaunay__lowest(missing));
}

/* The row of a triangle, with at least the signs of the wanted vertices known. */
DELAUNAY_INLINE const delaunay__sides *delaunay__sides_with(delaunay__search_tables *s,
                                                            uint32_t triple, uint32_t wanted)
{
    const uint8_t *t = s->triangle[triple];
    uint32_t missing = wanted & ~s->rows[triple].known & ~(1u << t[0] | 1u << t[1] | 1u << t[2]);
    if (missing) delaunay__find_sides(s, triple, missing);
    return &s->rows[triple];
}

static int delaunay__local_sign(delaunay__search_tables *s, uint32_t a, uint32_t b, uint32_t c,
                                uint32_t d)
{
    uint32_t id = delaunay__oriented(s, a, b, c);
    const delaunay__sides *row = delaunay__sides_with(s, id / 2, 1u << d);
    int sign = (int)(row->positive >> d & 1u) - (int)(row->negative >> d & 1u);
    return id & 1 ? -sign : sign;
}

/* delaunay_segment_crosses for local vertices, by the table of signs. */
static int delaunay__local_crosses(delaunay__search_tables *s, uint32_t a, uint32_t b, uint32_t p,
                                   uint32_t q, uint32_t r)
{
    int side, x, y, z;
    if (a == p || a == q || a == r || b == p || b == q || b == r) return 0;
    side = delaunay__local_sign(s, p, q, r, a);
    if (side == 0 || side * delaunay__local_sign(s, p, q, r, b) >= 0) return 0;
    x = delaunay__local_sign(s, p, q, a, b);
    y = delaunay__local_sign(s, q, r, a, b);
    if (x * y < 0) return 0;
    z = delaunay__local_sign(s, r, p, a, b);
    return x * z >= 0 && y * z >= 0;
}

/* Those of the wanted vertices that have not been tested in this search. */
static uint32_t delaunay__barred_unknown(const delaunay__search_tables *s, delaunay__barred *row,
                                         uint32_t wanted)
{
    if (row->search != s->search) {
        row->search = s->search;
        row->known = row->crossed = 0;
    }
    return wanted & ~row->known;
}

static void delaunay__barred_note(delaunay__barred *row, uint32_t p, int crossed)
{
    row->known |= 1u << p;
    row->crossed |= (uint32_t)crossed << p;
}

/* Those of the wanted vertices p for which a kept edge crosses triangle abp, so that the triangle
 * cannot be part of a result. */
static uint32_t delaunay__crossed_with(delaunay__search_tables *s, uint32_t a, uint32_t b,
                                       uint32_t wanted)
{
    const delaunay_window *w = s->window;
    delaunay__barred *row = &s->barred_pair[delaunay__pair(s, a, b)];
    uint32_t missing = delaunay__barred_unknown(s, row, wanted), i;
    for (; missing; missing &= missing - 1) {
        uint32_t p = delaunay__lowest(missing);
        int hit = 0;
        for (i = 0; i < w->num_kept_edges && !hit; i++)
            hit = delaunay__local_crosses(s, w->kept_edges[i][0], w->kept_edges[i][1], a, b, p);
        delaunay__barred_note(row, p, hit);
    }
    return row->crossed & wanted;
}

/* Those of the wanted vertices p for which edge ap passes through a kept facet. */
static uint32_t delaunay__piercing_with(delaunay__search_tables *s, uint32_t a, uint32_t wanted)
{
    const delaunay_window *w = s->window;
    delaunay__barred *row = &s->barred_vertex[a];
    uint32_t missing = delaunay__barred_unknown(s, row, wanted), i;
    for (; missing; missing &= missing - 1) {
        uint32_t p = delaunay__lowest(missing);
        int hit = 0;
        for (i = 0; i < w->num_kept_facets && !hit; i++)
            hit = delaunay__local_crosses(s, a, p, w->kept_facets[i][0], w->kept_facets[i][1],
                                          w->kept_facets[i][2]);
        delaunay__barred_note(row, p, hit);
    }
    return row->crossed & wanted;
}

/* 1 if the target segment crosses the triangle. */
static uint32_t delaunay__triple_crossed(delaunay__search_tables *s, uint32_t triple)
{
    const uint8_t *t = s->triangle[triple];
    const uint32_t *v = s->window->vertices, *o = s->out->target;
    if (s->triple_cost[triple] >> 1 != s->search)
        s->triple_cost[triple] =
            2 * s->search + (uint32_t)delaunay_segment_crosses(s->mesh, o[0], o[1], v[t[0]],
                                                               v[t[1]], v[t[2]], NULL);
    return s->triple_cost[triple] & 1;
}

/* 1 if edge ab pierces the target triangle. */
static uint32_t delaunay__pair_crossed(delaunay__search_tables *s, uint32_t a, uint32_t b)
{
    const uint32_t *v = s->window->vertices, *o = s->out->target;
    uint32_t pair = delaunay__pair(s, a, b);
    if (s->pair_cost[pair] >> 1 != s->search)
        s->pair_cost[pair] = 2 * s->search + (uint32_t)delaunay_segment_crosses(
                                                 s->mesh, v[a], v[b], o[0], o[1], o[2], NULL);
    return s->pair_cost[pair] & 1;
}

/* The quality of the tetrahedron of a triangle and p, computed once for its four triangles. The
 * vertices are passed in ascending order, the first two swapped if that order is negative. */
static double delaunay__local_quality(delaunay__search_tables *s, uint32_t triple, uint32_t p)
{
    const uint8_t *t = s->triangle[triple];
    uint32_t v[4], i, below, quad;
    delaunay__sides *row;
    const double *x[4];
    for (i = 0; i < 3 && t[i] < p; i++) v[i] = t[i];
    below = i;
    v[i] = p;
    for (; i < 3; i++) v[i + 1] = t[i];
    row = &s->rows[s->choose3[v[2]] + s->choose2[v[1]] + v[0]];
    quad = s->choose4[v[3]] + s->choose3[v[2]] + s->choose2[v[1]] + v[0];
    if (s->at_once ||
        ((row->measured >> v[3] & 1) && !(s->flags & DELAUNAY_SEARCH_NO_MEMORY)))
        return s->quality[quad];
    for (i = 0; i < 4; i++) x[i] = s->x[v[i]];
    if ((s->rows[triple].positive >> p ^ below) & 1) { /* p came to its place by 3 - below swaps */
        x[0] = s->x[v[1]];
        x[1] = s->x[v[0]];
    }
    row->measured |= 1u << v[3];
    return s->quality[quad] = s->out->quality(s->out->user, x[0], x[1], x[2], x[3]);
}

/* Those of the vertices left that lie in the closed tetrahedron abcp, where v is abc; the caller
 * leaves out those beyond abc. */
static uint32_t delaunay__swallowed(delaunay__search_tables *s, const uint32_t *v, uint32_t p,
                                    uint32_t left)
{
    uint32_t i;
    for (i = 0; i < 3 && left; i++) {
        uint32_t id = delaunay__oriented(s, v[i], v[(i + 1) % 3], p);
        const delaunay__sides *row = delaunay__sides_with(s, id / 2, left);
        left &= ~(id & 1 ? row->negative : row->positive);
    }
    return left;
}

/* Those of the candidates that may close an oriented triangle, as far as kept edges, kept facets
 * and interior vertices are concerned. */
static uint32_t delaunay__allowed(delaunay__search_tables *s, uint32_t id, const uint32_t *v,
                                  uint32_t candidates)
{
    const delaunay__sides *row = &s->rows[id / 2]; /* all signs are known */
    const uint32_t beside = s->interior & ~(id & 1 ? row->positive : row->negative) &
                            ~(1u << v[0] | 1u << v[1] | 1u << v[2]);
    uint32_t k, left;
    if (s->window->num_kept_edges)
        for (k = 0; k < 3 && candidates; k++)
            candidates &= ~delaunay__crossed_with(s, v[k], v[(k + 1) % 3], candidates);
    if (s->window->num_kept_facets)
        for (k = 0; k < 3 && candidates; k++)
            candidates &= ~delaunay__piercing_with(s, v[k], candidates);
    for (left = beside ? candidates : 0; left; left &= left - 1) {
        uint32_t p = delaunay__lowest(left);
        if (delaunay__swallowed(s, v, p, beside & ~(1u << p))) candidates &= ~(1u << p);
    }
    return candidates;
}

/* Those of the candidates whose tetrahedra are better than the bound; *top: the best quality. */
static uint32_t delaunay__better_one_by_one(delaunay__search_tables *s, uint32_t id,
                                            uint32_t candidates, double *top)
{
    uint32_t better = 0;
    for (; candidates; candidates &= candidates - 1) {
        uint32_t p = delaunay__lowest(candidates);
        double q = delaunay__local_quality(s, id / 2, p);
        if (!(q > s->best)) continue;
        if (q > *top) *top = q;
        better |= 1u << p;
    }
    return better;
}

/* The same, with all qualities computed at once. The table has one entry per tetrahedron, so the
 * value may be overwritten from another of its triangles, with another rounding. */
static uint32_t delaunay__better_at_once(delaunay__search_tables *s, uint32_t id, const uint32_t *v,
                                         uint32_t candidates, double *top)
{
    double apices[3 * DELAUNAY__MAX_POINTS], q[DELAUNAY__MAX_POINTS];
    uint8_t list[DELAUNAY__MAX_POINTS];
    const uint8_t *t = s->triangle[id / 2];
    const uint32_t *table[4], above = s->choose4[t[2]] + s->choose3[t[1]];
    uint32_t begin[4], better = 0, n = 0, i;
    for (; candidates; candidates &= candidates - 1) {
        uint32_t p = delaunay__lowest(candidates);
        for (i = 0; i < 3; i++) apices[n + i * DELAUNAY__MAX_POINTS] = s->axis[i][p];
        list[n++] = (uint8_t)p;
    }
    if (n == 0) return 0;
    for (i = n; i & 3; i++) /* pad to a multiple of four */
        apices[i] = apices[i + DELAUNAY__MAX_POINTS] = apices[i + 2 * DELAUNAY__MAX_POINTS] = 0;
    s->out->qualities(s->out->user, s->x[v[0]], s->x[v[1]], s->x[v[2]], n, apices, q);
    /* The number of a tetrahedron depends on how many of the triangle's vertices are below p. */
    begin[0] = above + s->choose2[t[0]];
    begin[1] = above + t[0];
    begin[2] = s->choose4[t[2]] + s->choose2[t[1]] + t[0];
    begin[3] = id / 2;
    table[0] = s->choose1;
    table[1] = s->choose2;
    table[2] = s->choose3;
    table[3] = s->choose4;
    for (i = 0; i < n; i++) {
        uint32_t p = list[i];
        uint32_t k = (uint32_t)(p > t[0]) + (uint32_t)(p > t[1]) + (uint32_t)(p > t[2]);
        s->quality[begin[k] + table[k][p]] = q[i];
        better |= (uint32_t)(q[i] > s->best) << p;
        if (q[i] > s->best && q[i] > *top) *top = q[i];
    }
    return better;
}

/* Finds all vertices that could close an oriented triangle under the present bound, whatever else
 * is on the front. */
static DELAUNAY__NOINLINE void delaunay__choose(delaunay__search_tables *s, uint32_t id)
{
    const delaunay__sides *row = delaunay__sides_with(s, id / 2, s->points);
    uint32_t left = s->points & (id & 1 ? row->negative : row->positive), v[3];
    delaunay__choice *choice = &s->choice[id];
    delaunay__oriented_vertices(s, id, v);
    choice->stamp = s->stamp;
    choice->top = 0;
    if (s->at_once) left = delaunay__better_at_once(s, id, v, left, &choice->top);
    else if (s->measures) left = delaunay__better_one_by_one(s, id, left, &choice->top);
    choice->mask = delaunay__allowed(s, id, v, left);
}

/* Counts one more use of an edge. Returns 1 if that adds to the cost: edges are counted, this is
 * the first use, and the edge is not on the boundary and pierces the target triangle. */
static uint32_t delaunay__use_pair(delaunay__search_tables *s, uint32_t a, uint32_t b)
{
    return s->pair_used[delaunay__pair(s, a, b)]++ == 0 && s->objective == DELAUNAY_FEWER_EDGES &&
           !(s->boundary_pairs[a] >> b & 1) && delaunay__pair_crossed(s, a, b);
}

DELAUNAY_INLINE void delaunay__front_add(delaunay__search_tables *s, uint32_t id)
{
    const uint8_t *t = s->triangle[id / 2];
    int k;
    s->front_sum += s->random[id];
    s->front[s->num_front] = (uint16_t)id;
    s->waiting[s->num_front] = s->choice[id];
    s->place[id] = (uint16_t)++s->num_front;
    for (k = 0; k < 3; k++)
        if (s->valence[t[k]]++ == 0) s->on_front |= 1u << t[k];
}

DELAUNAY_INLINE void delaunay__front_remove(delaunay__search_tables *s, uint32_t id)
{
    const uint8_t *t = s->triangle[id / 2];
    uint32_t at = s->place[id], last = s->front[--s->num_front];
    int k;
    s->front_sum -= s->random[id];
    s->front[at - 1] = (uint16_t)last;
    s->waiting[at - 1] = s->waiting[s->num_front];
    s->place[last] = (uint16_t)at;
    s->place[id] = 0;
    for (k = 0; k < 3; k++)
        if (--s->valence[t[k]] == 0) s->on_front &= ~(1u << t[k]);
}

/* What a pass over the front finds out before the next step. */
typedef struct delaunay__survey {
    uint32_t chosen;   /* the triangle with fewest candidates, the newest among equals */
    uint32_t mask;     /* its candidates; 0: the front is a dead end */
    double   minimax;  /* no completion has a better worst quality */
    uint32_t num_poor; /* triangles, of those looked at, that only bad tetrahedra can close */
} delaunay__survey;

/* One body, compiled for two kinds of processors. has_popcount: a constant, nonzero if the function
 * that it is inlined into is compiled for processors with the popcnt instruction. */
DELAUNAY__ALWAYS_INLINE void delaunay__survey_front(delaunay__search_tables *s, delaunay__survey *y,
                                                    const int has_popcount)
{
    uint32_t i, fewest = 99, num_poor = 0, open = s->on_front | (s->interior & ~s->used);
    const double good = s->out->good;
    double minimax = HUGE_VAL;
    y->chosen = y->mask = 0;
    for (i = s->num_front; i-- > 0;) {
        delaunay__choice *choice = &s->waiting[i];
        uint32_t count;
        if (choice->stamp != s->stamp) {
            if (s->choice[s->front[i]].stamp != s->stamp) delaunay__choose(s, s->front[i]);
            *choice = s->choice[s->front[i]];
        }
        count = delaunay__count_bits(choice->mask & open, has_popcount);
        minimax = choice->top < minimax ? choice->top : minimax;
        num_poor += choice->top < good;
        if (count >= fewest) continue;
        fewest = count;
        y->chosen = s->front[i];
        y->mask = choice->mask & open;
        if (count <= 1 || (s->flags & DELAUNAY_SEARCH_ANY_FACET)) break;
    }
    y->minimax = minimax;
    y->num_poor = num_poor;
}

static DELAUNAY__NOINLINE void delaunay__survey_plain(delaunay__search_tables *s,
                                                      delaunay__survey *y)
{
    delaunay__survey_front(s, y, 0);
}

#  if defined(DELAUNAY__AVX2)
DELAUNAY__TARGET static DELAUNAY__NOINLINE void delaunay__survey_avx2(delaunay__search_tables *s,
                                                                      delaunay__survey *y)
{
    delaunay__survey_front(s, y, 1);
}
#  endif

/* Puts the candidates in the order in which they are tried: high scores first [Marot 2020, 6.2.4].
 * Returns their number. */
static uint32_t delaunay__order_candidates(delaunay__search_tables *s, uint32_t id,
                                           const uint32_t *v, uint32_t mask, double worst,
                                           double minimax, uint8_t *order)
{
    int score[DELAUNAY__MAX_POINTS], points;
    uint32_t n = 0, p, i, k;
    if ((mask & (mask - 1)) == 0) {
        order[0] = (uint8_t)delaunay__lowest(mask);
        return 1;
    }
    for (; mask; mask &= mask - 1) {
        p = delaunay__lowest(mask);
        points = 0;
        if (!(s->flags & DELAUNAY_SEARCH_ANY_ORDER)) {
            if ((s->interior & ~s->used) >> p & 1) points += 4;
            for (k = 0; k < 3; k++) {
                uint32_t side = delaunay__oriented(s, v[k], v[(k + 1) % 3], p);
                if (s->place[side ^ 1]) points += 2;
                else if (s->objective == DELAUNAY_FEWER_FACES)
                    points -= 4 * (int)delaunay__triple_crossed(s, side / 2);
            }
            if (s->objective == DELAUNAY_FEWER_EDGES)
                for (k = 0; k < 3; k++) points -= 4 * (int)delaunay__pair_crossed(s, v[k], p);
            if (s->objective == DELAUNAY_BEST_QUALITY) {
                double q = delaunay__local_quality(s, id / 2, p);
                points += 2 * (q > worst) + 2 * (q > minimax);
            }
            if (s->objective == DELAUNAY_FEWER_BAD)
                points += 4 * (delaunay__local_quality(s, id / 2, p) >= s->out->good);
        }
        for (i = n++; i > 0 && score[i - 1] < points; i--) {
            score[i] = score[i - 1];
            order[i] = order[i - 1];
        }
        score[i] = points;
        order[i] = (uint8_t)p;
    }
    return n;
}

/* The front is empty: the tetrahedra on the stack fill the window. Records them as a result, unless
 * they miss an interior vertex or a kept edge. Returns 1 if the search can end, 0 if it goes on. */
static int delaunay__accept(delaunay__search_tables *s, const delaunay__tally *tally)
{
    const delaunay_window *w = s->window;
    uint32_t i;
    if (s->interior & ~s->used) return 0;
    for (i = 0; i < w->num_kept_edges; i++)
        if (!s->pair_used[delaunay__pair(s, w->kept_edges[i][0], w->kept_edges[i][1])]) return 0;
    s->found = 1;
    s->out->num_tets = s->depth;
    memcpy(s->out->tets, s->stack, 4 * (size_t)s->depth);
    s->out->value = s->measures ? tally->worst : (double)tally->cost;
    if (s->objective == DELAUNAY_FEWER_BAD) {
        s->out->num_bad = s->cost_bound = tally->cost;
        return tally->cost == 0;
    }
    if (s->objective != DELAUNAY_BEST_QUALITY) return 1;
    s->best = tally->worst;
    s->stamp++;
    return 0;
}

static int delaunay__search_front(delaunay__search_tables *s, const delaunay__tally *tally);

/* Puts tetrahedron v, p on the stack and searches on from there; on return the front is as before.
 * tally includes this tetrahedron, except for its crossings, which are added here. Returns 1: the
 * search is done, -1: a limit was met, 0: it goes on. */
static int delaunay__try_candidate(delaunay__search_tables *s, uint32_t id, const uint32_t *v,
                                   uint32_t p, delaunay__tally *tally)
{
    uint32_t side[3], k, joined = 0, used = s->used;
    int result = 0;
    if (s->depth == DELAUNAY_WINDOW_TETS || s->num_front + 3 > DELAUNAY__MAX_FRONT) return -1;
    for (k = 0; k < 3; k++) {
        side[k] = delaunay__oriented(s, v[k], v[(k + 1) % 3], p);
        if (s->place[side[k] ^ 1]) continue;
        if (s->place[side[k]]) return 0; /* a third tetrahedron at this triangle */
        joined |= 1u << k;
        if (s->objective == DELAUNAY_FEWER_FACES)
            tally->cost += delaunay__triple_crossed(s, side[k] / 2);
    }
    for (k = 0; s->counts_pairs && k < 3; k++) tally->cost += delaunay__use_pair(s, v[k], p);
    if (tally->cost < s->cost_bound && tally->weight <= s->max_weight) {
        delaunay__front_remove(s, id);
        for (k = 0; k < 3; k++)
            if (joined >> k & 1) delaunay__front_add(s, side[k]);
            else delaunay__front_remove(s, side[k] ^ 1);
        s->used |= 1u << p;
        for (k = 0; k < 3; k++) s->stack[s->depth][k] = (uint8_t)v[k];
        s->stack[s->depth++][3] = (uint8_t)p;
        result = delaunay__search_front(s, tally);
        s->depth--;
        s->used = used;
        for (k = 3; k-- > 0;)
            if (joined >> k & 1) delaunay__front_remove(s, side[k]);
            else delaunay__front_add(s, side[k] ^ 1);
        delaunay__front_add(s, id);
    }
    for (k = 0; s->counts_pairs && k < 3; k++) s->pair_used[delaunay__pair(s, v[k], p)]--;
    return result;
}

/* A key of all that decides whether the front can be completed: the front itself, and the interior
 * vertices and kept edges that are used already. Two fronts with the same 64 bits could make the
 * search miss a result, but never give a wrong one. */
static uint64_t delaunay__front_key(const delaunay__search_tables *s)
{
    const delaunay_window *w = s->window;
    uint64_t key = s->front_sum, kept = 0;
    uint32_t i;
    if (s->interior) key += delaunay__mix(s->interior & s->used);
    for (i = 0; i < w->num_kept_edges; i++) {
        uint32_t pair = delaunay__pair(s, w->kept_edges[i][0], w->kept_edges[i][1]);
        kept |= (uint64_t)(s->pair_used[pair] != 0) << i;
    }
    return kept ? key + delaunay__mix(kept) : key;
}

/* True if this front is known to be a dead end, found with at least as much left to spend. */
static int delaunay__is_dead(const delaunay__search_tables *s, const delaunay__dead_end *dead,
                             uint64_t key, const delaunay__tally *tally)
{
    return dead->front == key && dead->budget >= s->cost_bound - tally->cost &&
           (double)dead->weight >= s->max_weight - tally->weight;
}

/* Adds a tetrahedron of this quality to the tally. */
static void delaunay__tally_add(const delaunay__search_tables *s, delaunay__tally *tally, double q)
{
    if (q < tally->worst) tally->worst = q;
    if (!s->counts_bad || !(q < s->out->good)) return;
    tally->cost++;
    if (s->out->weigh) tally->weight += s->out->weigh(s->out->user, q);
}

static int delaunay__search_front(delaunay__search_tables *s, const delaunay__tally *tally)
{
    delaunay__survey survey;
    uint32_t id, v[3], n, i, poor;
    uint8_t order[DELAUNAY__MAX_POINTS];
    uint64_t key;
    delaunay__dead_end *dead;
    if (s->out->nodes == s->out->max_nodes) return -1;
    s->out->nodes++;
    if (s->num_front == 0) return delaunay__accept(s, tally);
    key = delaunay__front_key(s);
    /* The place does not depend on the search, the stored key does. */
    dead = &s->dead[key >> (64 - DELAUNAY__DEAD_BITS)];
    key += s->search_key;
    if (delaunay__is_dead(s, dead, key, tally)) return 0;
#  if defined(DELAUNAY__AVX2)
    if (s->simd) delaunay__survey_avx2(s, &survey);
    else
#  endif
        delaunay__survey_plain(s, &survey);
    poor = s->counts_bad ? (survey.num_poor + 3) / 4 : 0; /* each closes at most four triangles */
    if (!survey.mask || tally->cost + poor >= s->cost_bound ||
        tally->weight + poor > s->max_weight)
        return 0;
    id = survey.chosen;
    delaunay__oriented_vertices(s, id, v);
    n = delaunay__order_candidates(s, id, v, survey.mask, tally->worst, survey.minimax, order);
    for (i = 0; i < n; i++) {
        delaunay__tally next = *tally;
        int result;
        if (s->measures) {
            double q = delaunay__local_quality(s, id / 2, order[i]);
            if (!(q > s->best)) continue;
            delaunay__tally_add(s, &next, q);
        }
        result = delaunay__try_candidate(s, id, v, order[i], &next);
        if (result) return result;
        if (!(tally->worst > s->best))
            return 0; /* the stack limits the worst quality; the front itself is no dead end */
    }
    dead->front = key;
    dead->budget = s->cost_bound - tally->cost;
    dead->weight = (float)(s->max_weight - tally->weight);
    return 0;
}

/* Takes the points of the window. Signs and qualities of the leading vertices that are the same as
 * in the last search stay valid; the others are cleared. */
static void delaunay__tables_points(delaunay__search_tables *s, const delaunay_search *search)
{
    const delaunay_window *w = s->window;
    uint32_t same = 0, i, n = w->num_vertices, low;
    const delaunay_vertex *vertices = s->mesh->vertices;
    while (same < n && same < s->num_known &&
           !memcmp(s->x[same], vertices[w->vertices[same]].x, sizeof s->x[0]))
        same++;
    low = same < 32 ? (1u << same) - 1 : ~0u;
    if (same < s->num_known)
        for (i = 0; i < s->choose3[same]; i++) {
            s->rows[i].known &= low;
            s->rows[i].positive &= low;
            s->rows[i].negative &= low;
            s->rows[i].measured &= low;
        }
    for (i = same; i < n; i++) {
        const double *x = vertices[w->vertices[i]].x;
        memcpy(s->x[i], x, sizeof s->x[0]);
        s->axis[0][i] = x[0];
        s->axis[1][i] = x[1];
        s->axis[2][i] = x[2];
    }
    memset(&s->rows[s->choose3[same]], 0, (s->choose3[n] - s->choose3[same]) * sizeof *s->rows);
    s->num_known = n;
    if (!s->measures) return;
    if (s->known_quality != search->quality || s->known_user != search->user ||
        (s->flags & DELAUNAY_SEARCH_FORGET))
        for (i = 0; i < s->choose3[n]; i++) s->rows[i].measured = 0;
    s->known_quality = search->quality;
    s->known_user = search->user;
}

/* Begins a new search: raises the stamps, and clears what they apply to before they overflow. */
static void delaunay__tables_stamp(delaunay__search_tables *s)
{
    if (s->stamp >
        UINT32_MAX - 2 * DELAUNAY__NUM_QUADS) { /* the bound rises at most once per quality */
        memset(s->choice, 0, sizeof s->choice);
        s->stamp = 0;
    }
    s->stamp++;
    if (s->search == UINT32_MAX / 2) {
        memset(s->barred_pair, 0, sizeof s->barred_pair);
        memset(s->barred_vertex, 0, sizeof s->barred_vertex);
        memset(s->triple_cost, 0, sizeof s->triple_cost);
        memset(s->pair_cost, 0, sizeof s->pair_cost);
        memset(s->dead, 0, sizeof s->dead);
        s->search = 0;
    }
    s->search++;
    s->search_key = delaunay__mix((uint64_t)s->search << 32);
}

/* Puts the boundary, and both sides of kept facets, on the front. The triangles of the front face
 * the inside. Returns the cost of the kept facets, or UINT32_MAX if the boundary has a triangle
 * twice, which no triangulation can close. */
static uint32_t delaunay__tables_front(delaunay__search_tables *s)
{
    const delaunay_window *w = s->window;
    uint32_t i, k, id, cost = 0;
    memset(s->boundary_pairs, 0, w->num_vertices * sizeof *s->boundary_pairs);
    memset(s->pair_used, 0, s->choose2[w->num_vertices] * sizeof *s->pair_used);
    for (i = 0; i < w->num_facets; i++) {
        const uint8_t *f = w->facets[i];
        id = delaunay__oriented(s, f[0], f[2], f[1]);
        if (s->place[id]) return UINT32_MAX;
        delaunay__front_add(s, id);
        for (k = 0; k < 3; k++) {
            s->boundary_pairs[f[k]] |= 1u << f[(k + 1) % 3];
            s->boundary_pairs[f[(k + 1) % 3]] |= 1u << f[k];
        }
    }
    for (i = 0; i < w->num_kept_facets; i++) {
        const uint8_t *f = w->kept_facets[i];
        id = delaunay__oriented(s, f[0], f[1], f[2]);
        if (s->place[id] || s->place[id ^ 1]) continue;
        delaunay__front_add(s, id);
        delaunay__front_add(s, id ^ 1);
        if (s->objective == DELAUNAY_FEWER_FACES) cost += delaunay__triple_crossed(s, id / 2);
        for (k = 0; k < 3; k++) cost += delaunay__use_pair(s, f[k], f[(k + 1) % 3]);
        s->used |= 1u << f[0] | 1u << f[1] | 1u << f[2];
    }
    return cost;
}

DELAUNAY_API int delaunay_reconnect(const delaunay_mesh *mesh, delaunay_worker *worker,
                                    const delaunay_window *window, delaunay_search *search)
{
    delaunay__search_tables *s = worker->tables;
    uint32_t n = window->num_vertices;
    delaunay__tally tally;
    int result;
    if (!worker->has_tables) delaunay__tables_init(s);
    worker->has_tables = 1;
    s->mesh = mesh;
    s->window = window;
    s->out = search;
    s->objective = search->objective;
    s->measures =
        search->objective == DELAUNAY_BEST_QUALITY || search->objective == DELAUNAY_FEWER_BAD;
    s->flags = search->flags;
    s->counts_bad = search->objective == DELAUNAY_FEWER_BAD ||
                    (search->objective == DELAUNAY_BEST_QUALITY && search->weigh);
    s->counts_pairs = window->num_kept_edges || search->objective == DELAUNAY_FEWER_EDGES;
    s->at_once = s->measures && search->qualities && !(s->flags & DELAUNAY_SEARCH_NO_MEMORY);
    s->points = (n < 32 ? (1u << n) - 1 : ~0u) & ~window->dropped;
    s->interior = window->interior & ~window->dropped;
    s->used = s->depth = 0;
    s->found = 0;
    s->best = search->bound > 0 ? search->bound : 0;
    s->cost_bound =
        search->objective == DELAUNAY_FEWER_FACES || search->objective == DELAUNAY_FEWER_EDGES
            ? (search->bound <= 0    ? 0
               : search->bound < 1e9 ? (uint32_t)ceil(search->bound)
                                     : 1000000000u)
        : search->objective == DELAUNAY_FEWER_BAD ? search->num_bad
        : s->counts_bad                           ? search->num_bad + 1
                                                  : UINT32_MAX;
    s->max_weight = s->counts_bad && search->weigh ? search->max_weight : HUGE_VAL;
    search->nodes = search->num_tets = 0;
    search->proven = 0;
    search->value = 0;
    if (search->max_nodes == 0) search->max_nodes = DELAUNAY__DEFAULT_NODES;
    delaunay__tables_points(s, search);
    delaunay__tables_stamp(s);
    tally.worst = HUGE_VAL;
    tally.weight = 0;
    tally.cost = delaunay__tables_front(s);
    result = tally.cost < s->cost_bound ? delaunay__search_front(s, &tally) : 0;
    while (s->num_front) delaunay__front_remove(s, s->front[s->num_front - 1]);
    search->proven =
        result == 0 ||
        (s->found && (s->objective == DELAUNAY_ANY ||
                      (result > 0 && (s->measures || search->value <= 0))));
    return s->found;
}

/* A small set of tetrahedra, kept on the stack, to test whether a neighbour is in the window. Open
 * addressing; 0 is free. */
typedef struct delaunay__handles {
    delaunay_handle slot[1024];
    int             bits;
} delaunay__handles;

static void delaunay__handles_set(delaunay__handles *h, const delaunay_handle *t, size_t n)
{
    size_t i, j;
    for (h->bits = 3; (size_t)1 << h->bits < 2 * n; h->bits++) {}
    memset(h->slot, 0, sizeof *h->slot << h->bits);
    for (i = 0; i < n; i++) {
        for (j = delaunay__hash(t[i], h->bits); h->slot[j];
             j = (j + 1) & (((size_t)1 << h->bits) - 1)) {}
        h->slot[j] = t[i];
    }
}

static int delaunay__handles_has(const delaunay__handles *h, delaunay_handle t)
{
    size_t j = delaunay__hash(t, h->bits);
    if (t == 0) return 0;
    while (h->slot[j] && h->slot[j] != t) j = (j + 1) & (((size_t)1 << h->bits) - 1);
    return h->slot[j] == t;
}

/* Local numbers of mesh vertices while a window is filled: open addressing, 0 is free (it is the
 * ghost, which no window has). */
typedef struct delaunay__numbers {
    uint32_t v[128];
    uint8_t  local[128];
} delaunay__numbers;

/* The slot of v, a free one if v is new. */
static size_t delaunay__number_slot(const delaunay__numbers *table, uint32_t v)
{
    size_t j = delaunay__hash(v, 7);
    while (table->v[j] && table->v[j] != v) j = (j + 1) & 127;
    return j;
}

/* The local number of v, which is added to the window if it is new. */
static uint32_t delaunay__number(delaunay__numbers *table, delaunay_window *w, uint32_t v)
{
    size_t j = delaunay__number_slot(table, v);
    if (!table->v[j]) {
        table->v[j] = v;
        table->local[j] = (uint8_t)w->num_vertices;
        w->vertices[w->num_vertices++] = v;
    }
    return table->local[j];
}

/* What delaunay_window_set knows of a window while it fills it. */
typedef struct delaunay__window_filling {
    const delaunay_mesh   *mesh;
    const delaunay_handle *tets;
    size_t   num_tets;
    uint8_t  local[DELAUNAY_WINDOW_TETS][4];  /* the vertices of each tetrahedron */
    uint32_t pairs[DELAUNAY_WINDOW_VERTICES]; /* bit j of entry i: edge i-j is on the boundary, or
                                               * listed */
} delaunay__window_filling;

/* Numbers the vertices. Returns 0 if there is a ghost among the tetrahedra or a vertex too many. */
static int delaunay__window_vertices(delaunay_window *w, delaunay__window_filling *f,
                                     uint32_t max_vertices)
{
    delaunay__numbers numbers;
    size_t i, k;
    memset(numbers.v, 0, sizeof numbers.v);
    for (i = 0; i < f->num_tets; i++) {
        const uint32_t *v = f->mesh->tets[f->tets[i]].v;
        if (v[3] == DELAUNAY_GHOST) return 0;
        for (k = 0; k < 4; k++) {
            if (w->num_vertices == max_vertices &&
                !numbers.v[delaunay__number_slot(&numbers, v[k])])
                return 0;
            f->local[i][k] = (uint8_t)delaunay__number(&numbers, w, v[k]);
        }
    }
    return 1;
}

/* Lists the facets of the boundary and, if keep_facets is set, those inside that are constrained.
 * Returns 0 if they are too many. */
static int delaunay__window_facets(delaunay_window *w, delaunay__window_filling *f, int keep_facets)
{
    delaunay__handles inside;
    uint32_t boundary = 0;
    size_t i, k;
    delaunay__handles_set(&inside, f->tets, f->num_tets);
    memset(f->pairs, 0, w->num_vertices * sizeof *f->pairs);
    for (i = 0; i < f->num_tets; i++) {
        const delaunay_tet *t = &f->mesh->tets[f->tets[i]];
        for (k = 0; k < 4; k++) {
            const uint8_t *o = delaunay_facet_order((int)k);
            uint8_t a = f->local[i][o[0]], b = f->local[i][o[1]], c = f->local[i][o[2]], *facet;
            if (delaunay__handles_has(&inside, t->n[k] / 4)) {
                if (!keep_facets || t->n[k] / 4 < f->tets[i] ||
                    !(f->mesh->flags[f->tets[i]] & DELAUNAY_FACET_BIT(k)))
                    continue;
                if (w->num_kept_facets == DELAUNAY_WINDOW_KEPT) return 0;
                facet = w->kept_facets[w->num_kept_facets++];
            } else {
                if (w->num_facets == DELAUNAY_WINDOW_FACETS) return 0;
                facet = w->facets[w->num_facets++];
                boundary |= 1u << a | 1u << b | 1u << c;
                f->pairs[a] |= 1u << b | 1u << c;
                f->pairs[b] |= 1u << a | 1u << c;
                f->pairs[c] |= 1u << a | 1u << b;
            }
            facet[0] = a;
            facet[1] = b;
            facet[2] = c;
        }
    }
    w->interior = (w->num_vertices < 32 ? (1u << w->num_vertices) - 1 : ~0u) & ~boundary;
    return 1;
}

/* Lists the constrained edges inside, each once. Returns 0 if they are too many. */
static int delaunay__window_kept_edges(delaunay_window *w, delaunay__window_filling *f)
{
    size_t i, k;
    for (i = 0; i < f->num_tets; i++) {
        unsigned flags = f->mesh->flags[f->tets[i]];
        for (k = 0; k < 6 && (flags & DELAUNAY_EDGE_BITS); k++) {
            const uint8_t *o = delaunay_edge_order((int)k);
            uint8_t a = f->local[i][o[0]], b = f->local[i][o[1]], *edge;
            if (!(flags & DELAUNAY_EDGE_BIT(k)) || (f->pairs[a] >> b & 1)) continue;
            if (w->num_kept_edges == DELAUNAY_WINDOW_KEPT) return 0;
            f->pairs[a] |= 1u << b;
            f->pairs[b] |= 1u << a;
            edge = w->kept_edges[w->num_kept_edges++];
            edge[0] = a;
            edge[1] = b;
        }
    }
    return 1;
}

DELAUNAY_API int delaunay_window_set(delaunay_window *window, const delaunay_mesh *mesh,
                                     const delaunay_handle *tets, size_t num_tets,
                                     uint32_t max_vertices, int keep_edges, int keep_facets)
{
    delaunay__window_filling filling;
    if (max_vertices > DELAUNAY_WINDOW_VERTICES) max_vertices = DELAUNAY_WINDOW_VERTICES;
    if (!mesh->flags) keep_edges = keep_facets = 0;
    window->num_tets = window->num_vertices = window->num_facets = 0;
    window->num_kept_edges = window->num_kept_facets = window->interior = window->dropped = 0;
    if (num_tets == 0 || num_tets > DELAUNAY_WINDOW_TETS) return 0;
    filling.mesh = mesh;
    filling.tets = tets;
    filling.num_tets = num_tets;
    if (!delaunay__window_vertices(window, &filling, max_vertices) ||
        !delaunay__window_facets(window, &filling, keep_facets))
        return 0;
    window->num_tets = (uint32_t)num_tets;
    memcpy(window->tets, tets, num_tets * sizeof *tets);
    return !keep_edges || delaunay__window_kept_edges(window, &filling);
}

DELAUNAY_API delaunay_result delaunay_window_apply(delaunay_mesh *mesh, delaunay_worker *worker,
                                                   const delaunay_window *window,
                                                   const delaunay_search *search,
                                                   delaunay_handle *slots)
{
    uint32_t i, k;
    for (i = 0; i < search->num_tets; i++)
        for (k = 0; k < 4; k++) worker->commit[4 * i + k] = window->vertices[search->tets[i][k]];
    return delaunay_replace(mesh, worker, window->tets, window->num_tets, worker->commit,
                            search->num_tets, slots);
}

/* The number of interior edges that pierce a triangle. Goes through the edges of all tetrahedra,
 * each once, and skips those of the boundary. */
static uint32_t delaunay__window_edges(const delaunay_mesh *mesh, const delaunay_window *window,
                                       const uint32_t *target)
{
    uint32_t pairs[DELAUNAY_WINDOW_VERTICES], i, k, a, b, count = 0;
    memset(pairs, 0, sizeof pairs);
    for (i = 0; i < window->num_facets; i++)
        for (k = 0; k < 3; k++) {
            a = window->facets[i][k];
            b = window->facets[i][(k + 1) % 3];
            pairs[a] |= 1u << b;
            pairs[b] |= 1u << a;
        }
    for (i = 0; i < window->num_tets; i++) {
        const uint32_t *v = mesh->tets[window->tets[i]].v;
        uint32_t local[4];
        for (k = 0; k < 4; k++)
            for (local[k] = 0; window->vertices[local[k]] != v[k]; local[k]++) {}
        for (k = 0; k < 6; k++) {
            a = local[delaunay_edge_order((int)k)[0]];
            b = local[delaunay_edge_order((int)k)[1]];
            if (pairs[a] >> b & 1) continue;
            pairs[a] |= 1u << b;
            pairs[b] |= 1u << a;
            count +=
                (uint32_t)delaunay_segment_crosses(mesh, window->vertices[a], window->vertices[b],
                                                   target[0], target[1], target[2], NULL);
        }
    }
    return count;
}

DELAUNAY_API uint32_t delaunay_window_crossings(const delaunay_mesh *mesh,
                                                const delaunay_window *window,
                                                delaunay_objective objective,
                                                const uint32_t *target)
{
    delaunay__handles inside;
    uint32_t i, count = 0;
    int k;
    if (objective == DELAUNAY_FEWER_EDGES) return delaunay__window_edges(mesh, window, target);
    if (objective != DELAUNAY_FEWER_FACES) return 0;
    delaunay__handles_set(&inside, window->tets, window->num_tets);
    for (i = 0; i < window->num_tets; i++) {
        const delaunay_tet *t = &mesh->tets[window->tets[i]];
        for (k = 0; k < 4; k++) {
            const uint8_t *o = delaunay_facet_order(k);
            if (t->n[k] / 4 < window->tets[i] || !delaunay__handles_has(&inside, t->n[k] / 4))
                continue;
            count += (uint32_t)delaunay_segment_crosses(mesh, target[0], target[1], t->v[o[0]],
                                                        t->v[o[1]], t->v[o[2]], NULL);
        }
    }
    return count;
}

DELAUNAY_API int delaunay_segment_crosses(const delaunay_mesh *mesh, uint32_t a, uint32_t b,
                                          uint32_t p, uint32_t q, uint32_t r, int *zeros)
{
    const delaunay_vertex *v = mesh->vertices;
    int side, x, y, z;
    if (zeros) *zeros = 0;
    if (a == p || a == q || a == r || b == p || b == q || b == r) return 0;
    side = delaunay_orient3d(v[p].x, v[q].x, v[r].x, v[a].x);
    if (side == 0 || side * delaunay_orient3d(v[p].x, v[q].x, v[r].x, v[b].x) >= 0) return 0;
    x = delaunay_orient3d(v[p].x, v[q].x, v[a].x, v[b].x);
    y = delaunay_orient3d(v[q].x, v[r].x, v[a].x, v[b].x);
    if (x * y < 0) return 0;
    z = delaunay_orient3d(v[r].x, v[p].x, v[a].x, v[b].x);
    if (x * z < 0 || y * z < 0) return 0;
    if (zeros) *zeros = (x == 0) | (y == 0) << 1 | (z == 0) << 2;
    return 1;
}

/* ---- >>speculate  engine (b): plan on a frozen mesh, reserve, commit ------------------------ */
/* A plan writes a set W of tetrahedra: those that it replaces, their neighbours (whose handles
 * change) and the stars of vertices that it moves. It also reads a set R. Each item planned in a
 * round puts its claim into the owner entry of each tetrahedron of W; the claim of the item that
 * comes first in the list prevails. An item wins if it owns all of its W and no tetrahedron of R is
 * owned by an item before it. So no two winners write the same tetrahedron, and what a winner read
 * is written only by winners after it, whose effects it need not see: the round has the same result
 * as its winners one after the other, in order. Which items win depends on the plans alone, not on
 * the threads, and the slots of the winners are assigned by sums in order; hence the same bytes for
 * any number of threads. Two winners can share a vertex: its entry in vertex_tet is zeroed first,
 * and then gets the largest of the slots. */

static int delaunay__thread_number(void)
{
#if DELAUNAY__PARALLEL
    return omp_get_thread_num();
#else
    return 0;
#endif
}

static void delaunay__atomic_max32(uint32_t *p, uint32_t value)
{
#if DELAUNAY__PARALLEL
    uint32_t old = __atomic_load_n(p, __ATOMIC_RELAXED);
    while (value > old &&
           !__atomic_compare_exchange_n(p, &old, value, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#else
    if (value > *p) *p = value;
#endif
}

static void delaunay__atomic_max(delaunay_handle *p, delaunay_handle value)
{
#if DELAUNAY__PARALLEL
    delaunay_handle old = __atomic_load_n(p, __ATOMIC_RELAXED);
    while (value > old &&
           !__atomic_compare_exchange_n(p, &old, value, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#else
    if (value > *p) *p = value;
#endif
}

static void delaunay__atomic_set(delaunay_handle *p, delaunay_handle value)
{
#if DELAUNAY__PARALLEL
    __atomic_store_n(p, value, __ATOMIC_RELAXED);
#else
    *p = value;
#endif
}

static void delaunay__atomic_set32(uint32_t *p, uint32_t value)
{
#if DELAUNAY__PARALLEL
    __atomic_store_n(p, value, __ATOMIC_RELAXED);
#else
    *p = value;
#endif
}

/* A spin lock around the mesh's memory, through which the workers of an engine allocate: the
 * caller's allocator must be called by one thread at a time. */
typedef struct delaunay__gate {
    delaunay_memory *memory;
    char             locked;
} delaunay__gate;

static void delaunay__gate_lock(delaunay__gate *gate)
{
#if DELAUNAY__PARALLEL
    unsigned tries = 0;
    while (__atomic_test_and_set(&gate->locked, __ATOMIC_ACQUIRE)) {
        if (++tries % 256) DELAUNAY__PAUSE();
        else DELAUNAY__YIELD(); /* the thread that holds the lock may wait for this processor */
    }
#else
    gate->locked = 1;
#endif
}

static void delaunay__gate_unlock(delaunay__gate *gate)
{
#if DELAUNAY__PARALLEL
    __atomic_clear(&gate->locked, __ATOMIC_RELEASE);
#else
    gate->locked = 0;
#endif
}

static void *delaunay__gate_alloc(void *user, size_t size)
{
    delaunay__gate *gate = (delaunay__gate *)user;
    void *block;
    delaunay__gate_lock(gate);
    block = delaunay_alloc(gate->memory, size, 1);
    delaunay__gate_unlock(gate);
    return block;
}

static void delaunay__gate_release(void *user, void *block)
{
    delaunay__gate *gate = (delaunay__gate *)user;
    delaunay__gate_lock(gate);
    delaunay_release(gate->memory, block);
    delaunay__gate_unlock(gate);
}

/* States of a plan within a batch. */
enum {
    DELAUNAY__PLAN_NEW,   /* the item has no plan yet */
    DELAUNAY__PLAN_WAITS, /* planned, not committed so far */
    DELAUNAY__PLAN_WINS,  /* is committed in this round */
    DELAUNAY__PLAN_IDLE,  /* finished: nothing to do, or dropped for max_vertices */
    DELAUNAY__PLAN_FAILED /* an error; committed is its code */
};

enum { DELAUNAY__DEFAULT_BATCH = 1024, DELAUNAY__LEAST_BATCH = 32 };

/* In a round the calling thread works alone as long as this pays: it makes plans for at least 5e-5
 * seconds, and it reserves, decides and commits if there are fewer than 256 plans. */
#  define DELAUNAY__LEAST_ALONE 5e-5
enum { DELAUNAY__ALONE_PLANS = 256 };

struct delaunay_engine {
    delaunay_mesh    *mesh;
    delaunay_host     host;
    delaunay__gate    gate;
    int               num_threads;
    delaunay_memory  *memories; /* one per thread, all behind the gate */
    delaunay_worker **workers;
    int               lent;     /* the only worker belongs to the caller */
    delaunay_plan   **plans;    /* those in flight come first, in order */
    size_t            cap_plans;
    uint32_t         *owner;    /* per slot: claim of the first plan that would write it, or 0 */
    uint32_t         *version;  /* per slot: the round of the last write */
    size_t            cap_slots;
    uint32_t          round;
    delaunay_crew     crew;
};

/* -- filling a plan */

static int delaunay__plan_push(delaunay_plan *plan, delaunay_list *list, delaunay_handle t)
{
    list->memory = plan->memory;
    return delaunay_list_push(list, t) == DELAUNAY_OK ? DELAUNAY_PLAN_COMMIT
                                                      : (int)DELAUNAY_ERROR_OUT_OF_MEMORY;
}

DELAUNAY_API int delaunay_plan_read(delaunay_plan *plan, delaunay_handle t)
{
    return delaunay__plan_push(plan, &plan->read, t);
}

DELAUNAY_API int delaunay_plan_remove(delaunay_plan *plan, delaunay_handle t)
{
    return delaunay__plan_push(plan, &plan->old_tets, t);
}

DELAUNAY_API int delaunay_plan_add(delaunay_plan *plan, uint32_t a, uint32_t b, uint32_t c,
                                   uint32_t d)
{
    uint32_t *v;
    if (plan->num_tets == plan->cap_tets) {
        size_t cap = 2 * plan->cap_tets + 32;
        void *tets = delaunay_grow(plan->memory, plan->tets, 4 * plan->num_tets, 4 * cap,
                                   sizeof *plan->tets);
        if (!tets) return DELAUNAY_ERROR_OUT_OF_MEMORY;
        plan->tets = (uint32_t *)tets;
        plan->cap_tets = cap;
    }
    v = plan->tets + 4 * plan->num_tets++;
    v[0] = a;
    v[1] = b;
    v[2] = c;
    v[3] = d;
    return DELAUNAY_PLAN_COMMIT;
}

DELAUNAY_API int delaunay_plan_vertex(delaunay_plan *plan, const double *xyz)
{
    if (plan->num_new == DELAUNAY_PLAN_VERTICES) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    memcpy(plan->new_xyz[plan->num_new++], xyz, sizeof plan->new_xyz[0]);
    return DELAUNAY_PLAN_COMMIT;
}

DELAUNAY_API int delaunay_plan_move(delaunay_plan *plan, uint32_t v, const double *xyz,
                                    const delaunay_handle *star, size_t num_star)
{
    size_t i;
    int answer = DELAUNAY_PLAN_COMMIT;
    if (plan->num_moved == DELAUNAY_PLAN_VERTICES) return DELAUNAY_ERROR_INVALID_ARGUMENT;
    plan->moved[plan->num_moved] = v;
    memcpy(plan->moved_xyz[plan->num_moved++], xyz, sizeof plan->moved_xyz[0]);
    for (i = 0; i < num_star && answer > 0; i++)
        answer = delaunay__plan_push(plan, &plan->written, star[i]);
    return answer;
}

DELAUNAY_API int delaunay_plan_window(delaunay_plan *plan, const delaunay_window *window,
                                      const delaunay_search *search)
{
    uint32_t i;
    int answer = DELAUNAY_PLAN_COMMIT;
    for (i = 0; i < window->num_tets && answer > 0; i++)
        answer = delaunay_plan_remove(plan, window->tets[i]);
    for (i = 0; i < search->num_tets && answer > 0; i++) {
        const uint8_t *v = search->tets[i];
        answer = delaunay_plan_add(plan, window->vertices[v[0]], window->vertices[v[1]],
                                   window->vertices[v[2]], window->vertices[v[3]]);
    }
    return answer;
}

static void delaunay__plan_clear(delaunay_plan *plan, delaunay_memory *memory)
{
    plan->memory = plan->star.memory = plan->scratch.memory = plan->slots.memory = memory;
    plan->read.count = plan->written.count = plan->old_tets.count = plan->star.count =
        plan->scratch.count = 0;
    plan->slots.count = plan->num_tets = 0;
    plan->num_new = plan->num_moved = 0;
    plan->committed = 0;
    memset(plan->data, 0, sizeof plan->data);
}

static void delaunay__plan_free(delaunay_plan *plan, delaunay_memory *memory)
{
    if (!plan) return;
    plan->star.memory = plan->scratch.memory = plan->read.memory = plan->written.memory = memory;
    plan->old_tets.memory = plan->slots.memory = memory;
    delaunay_list_free(&plan->star);
    delaunay_list_free(&plan->scratch);
    delaunay_list_free(&plan->read);
    delaunay_list_free(&plan->written);
    delaunay_list_free(&plan->old_tets);
    delaunay_list_free(&plan->slots);
    delaunay_release(memory, plan->tets);
    delaunay_release(memory, plan->link);
    delaunay_release(memory, plan->link_inside);
    delaunay_release(memory, plan->link_flags);
    delaunay_release(memory, plan);
}

/* -- the engine */

static delaunay_engine *delaunay__engine_new(delaunay_mesh *mesh, const delaunay_host *host,
                                             delaunay_worker *lent)
{
    delaunay_engine *e = (delaunay_engine *)delaunay_alloc_zeroed(&mesh->memory, 1, sizeof *e);
    int i;
    if (!e) return NULL;
    e->mesh = mesh;
    if (host) e->host = *host;
    e->gate.memory = &mesh->memory;
    e->num_threads = DELAUNAY__PARALLEL && !lent ? delaunay_threads(host) : 1;
    e->lent = lent != NULL;
    e->host.num_threads = e->num_threads; /* the number of workers; OpenMP's maximum may change */
    e->crew.host = &e->host;
    e->memories = (delaunay_memory *)delaunay_alloc_zeroed(&mesh->memory, (size_t)e->num_threads,
                                                           sizeof *e->memories);
    e->workers = (delaunay_worker **)delaunay_alloc_zeroed(&mesh->memory, (size_t)e->num_threads,
                                                           sizeof *e->workers);
    for (i = 0; e->memories && e->workers && i < e->num_threads; i++) {
        e->memories[i].allocator.alloc = delaunay__gate_alloc;
        e->memories[i].allocator.release = delaunay__gate_release;
        e->memories[i].allocator.user = &e->gate;
        e->workers[i] = lent ? lent : delaunay_worker_new(&e->memories[i]);
        if (!e->workers[i]) break;
    }
    if (i == e->num_threads) return e;
    delaunay_engine_free(e);
    return NULL;
}

DELAUNAY_API delaunay_engine *delaunay_engine_new(delaunay_mesh *mesh, const delaunay_host *host)
{
    return delaunay__engine_new(mesh, host, NULL);
}

DELAUNAY_API delaunay_engine *delaunay_engine_new_lent(delaunay_mesh *mesh,
                                                       const delaunay_host *host,
                                                       delaunay_worker *worker)
{
    return delaunay__engine_new(mesh, host, worker);
}

DELAUNAY_API void delaunay_engine_free(delaunay_engine *engine)
{
    delaunay_memory *m;
    size_t i;
    if (!engine) return;
    m = engine->gate.memory;
    for (i = 0; i < engine->cap_plans; i++)
        delaunay__plan_free(engine->plans[i], &engine->memories[0]);
    for (i = 0; engine->workers && !engine->lent && i < (size_t)engine->num_threads; i++)
        delaunay_worker_free(engine->workers[i]);
    delaunay_release(m, engine->plans);
    delaunay_release(m, engine->owner);
    delaunay_release(m, engine->version);
    delaunay_release(m, engine->workers);
    delaunay_release(m, engine->memories);
    delaunay_release(m, engine);
}

DELAUNAY_API uint32_t delaunay_engine_version(const delaunay_engine *engine, delaunay_handle t)
{
    return t < engine->cap_slots ? engine->version[t] : 0;
}

DELAUNAY_API uint32_t delaunay_engine_round(const delaunay_engine *engine) { return engine->round; }

DELAUNAY_API delaunay_worker *delaunay_engine_worker(delaunay_engine *engine, int thread)
{
    return thread < engine->num_threads ? engine->workers[thread] : NULL;
}

/* Makes room in owner and version for so many slots, and some more. */
static delaunay_result delaunay__engine_slots(delaunay_engine *e, size_t slots)
{
    size_t cap = slots + slots / 64 + 1024, old = e->cap_slots;
    uint32_t *owner, *version;
    if (slots <= old) return DELAUNAY_OK;
    if (cap > e->mesh->cap_tets) cap = e->mesh->cap_tets;
    owner = (uint32_t *)delaunay_grow_zeroed(e->gate.memory, e->owner, old, cap, sizeof *owner);
    if (!owner) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    e->owner = owner;
    version =
        (uint32_t *)delaunay_grow_zeroed(e->gate.memory, e->version, old, cap, sizeof *version);
    if (!version) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    e->version = version;
    e->cap_slots = cap;
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_engine_touch(delaunay_engine *engine, delaunay_handle t)
{
    delaunay_result result = delaunay__engine_slots(engine, engine->mesh->num_tets);
    if (result == DELAUNAY_OK) engine->version[t] = engine->round;
    return result;
}

static delaunay_result delaunay__engine_plans(delaunay_engine *e, size_t batch)
{
    delaunay_plan **plans;
    if (batch <= e->cap_plans) return DELAUNAY_OK;
    plans = (delaunay_plan **)delaunay_grow(e->gate.memory, (void *)e->plans, e->cap_plans, batch,
                                            sizeof *plans);
    if (!plans) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    for (e->plans = plans; e->cap_plans < batch; e->cap_plans++) {
        plans[e->cap_plans] =
            (delaunay_plan *)delaunay_alloc_zeroed(&e->memories[0], 1, sizeof **plans);
        if (!plans[e->cap_plans]) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    return DELAUNAY_OK;
}

/* -- one round */

/* True if nothing that a waiting plan has read was written since it was made. */
static int delaunay__plan_is_fresh(const delaunay_engine *e, const delaunay_plan *plan)
{
    size_t i;
    for (i = 0; i < plan->written.count; i++)
        if (e->version[plan->written.items[i]] >= plan->round) return 0;
    for (i = 0; i < plan->read.count; i++)
        if (e->version[plan->read.items[i]] >= plan->round) return 0;
    return 1;
}

/* Computes the links of the new tetrahedra and stores them in the plan: then the commit needs no
 * scratch memory, and so cannot fail. */
static delaunay_result delaunay__plan_link(const delaunay_engine *e, delaunay_worker *w,
                                           delaunay_plan *plan)
{
    size_t n = plan->num_tets;
    delaunay_result result;
    if (n == 0 && plan->old_tets.count == 0) return DELAUNAY_OK;
    result = delaunay__replace_links(e->mesh, w, plan->old_tets.items, plan->old_tets.count,
                                     plan->tets, n);
    if (result != DELAUNAY_OK) return result;
    if (n > plan->cap_link) {
        size_t cap = n + n / 2 + 16;
        delaunay_release(plan->memory, plan->link);
        delaunay_release(plan->memory, plan->link_inside);
        delaunay_release(plan->memory, plan->link_flags);
        plan->cap_link = 0;
        plan->link = (delaunay_handle *)delaunay_alloc(plan->memory, cap, 4 * sizeof *plan->link);
        plan->link_inside = (uint8_t *)delaunay_alloc(plan->memory, cap, 4);
        plan->link_flags = (uint16_t *)delaunay_alloc(plan->memory, cap, sizeof *plan->link_flags);
        if (!plan->link || !plan->link_inside || !plan->link_flags)
            return DELAUNAY_ERROR_OUT_OF_MEMORY;
        plan->cap_link = cap;
    }
    if (n) {
        memcpy(plan->link, w->link, 4 * n * sizeof *plan->link);
        memcpy(plan->link_inside, w->link_inside, 4 * n);
        memcpy(plan->link_flags, w->link_flags, n * sizeof *plan->link_flags);
    }
    plan->color =
        e->mesh->color && plan->old_tets.count ? e->mesh->color[plan->old_tets.items[0]] : 0;
    return DELAUNAY_OK;
}

/* Completes W, the list of what the plan writes, and makes room for the slots. */
static int delaunay__plan_finish(const delaunay_engine *e, delaunay_worker *w, delaunay_plan *plan)
{
    delaunay_result result = delaunay__plan_link(e, w, plan);
    int answer = result == DELAUNAY_OK ? DELAUNAY_PLAN_COMMIT : (int)result, k;
    size_t i;
    for (i = 0; i < plan->old_tets.count && answer > 0; i++) {
        delaunay_handle t = plan->old_tets.items[i];
        answer = delaunay__plan_push(plan, &plan->written, t);
        for (k = 0; k < 4 && answer > 0; k++)
            if (e->mesh->tets[t].n[k])
                answer = delaunay__plan_push(plan, &plan->written, e->mesh->tets[t].n[k] / 4);
    }
    for (i = 0; i < plan->num_tets && answer > 0; i++)
        answer = delaunay__plan_push(plan, &plan->slots, 0);
    return answer;
}

/* Calls the plan function for the item, unless a plan from an earlier round is still valid. */
static void delaunay__plan_make(delaunay_engine *e, const delaunay_speculation *job,
                                delaunay_plan *plan, int thread)
{
    delaunay_worker *w = e->workers[thread];
    int answer;
    if (plan->state == DELAUNAY__PLAN_WAITS && delaunay__plan_is_fresh(e, plan)) return;
    delaunay__plan_clear(plan, &e->memories[thread]);
    plan->round = e->round;
    answer = job->plan(job->user, e->mesh, w, plan->item, plan);
    if (answer == DELAUNAY_PLAN_COMMIT) answer = delaunay__plan_finish(e, w, plan);
    plan->state = answer == DELAUNAY_PLAN_COMMIT    ? DELAUNAY__PLAN_WAITS
                  : answer == DELAUNAY_PLAN_NOTHING ? DELAUNAY__PLAN_IDLE
                                                    : DELAUNAY__PLAN_FAILED;
    plan->committed = answer;
}

/* The claim of the plan at a position in the list: the first has the greatest, which prevails. */
static uint32_t delaunay__claim(size_t position) { return UINT32_MAX - (uint32_t)position; }

static void delaunay__plan_reserve(delaunay_engine *e, const delaunay_plan *plan, uint32_t claim)
{
    size_t i;
    if (plan->state != DELAUNAY__PLAN_WAITS) return;
    for (i = 0; i < plan->written.count; i++)
        delaunay__atomic_max32(&e->owner[plan->written.items[i]], claim);
}

static void delaunay__plan_decide(const delaunay_engine *e, delaunay_plan *plan, uint32_t claim)
{
    size_t i;
    if (plan->state != DELAUNAY__PLAN_WAITS) return;
    for (i = 0; i < plan->written.count; i++)
        if (e->owner[plan->written.items[i]] != claim) return;
    for (i = 0; i < plan->read.count; i++)
        if (e->owner[plan->read.items[i]] > claim) return;
    plan->state = DELAUNAY__PLAN_WINS;
}

static void delaunay__plan_release_owners(delaunay_engine *e, const delaunay_plan *plan)
{
    size_t i;
    if (plan->state != DELAUNAY__PLAN_WAITS && plan->state != DELAUNAY__PLAN_WINS) return;
    for (i = 0; i < plan->written.count; i++)
        delaunay__atomic_set32(&e->owner[plan->written.items[i]], 0);
}

/* Assigns the numbers of the winners' new vertices and slots, by sums in order, and makes room for
 * all of them. A winner reuses the slots of its old tetrahedra; more come from the free list, last
 * in first out, then from the end of the array. A plan whose new vertices would exceed max_vertices
 * is dropped from the winners. */
static delaunay_result delaunay__round_assign(delaunay_engine *e, const delaunay_speculation *job,
                                              size_t num)
{
    delaunay_mesh *m = e->mesh;
    size_t most = job->max_vertices ? job->max_vertices : (size_t)UINT32_MAX;
    size_t i, j, surplus = 0, freed = 0, vertices = m->num_vertices, fresh;
    delaunay_handle free_left;
    delaunay_result result = DELAUNAY_OK;
    for (i = 0; i < num; i++) {
        delaunay_plan *p = e->plans[i];
        size_t own = p->old_tets.count;
        if (p->state != DELAUNAY__PLAN_WINS) continue;
        if (p->num_new && vertices + p->num_new > most) {
            delaunay__plan_release_owners(e, p);
            p->state = DELAUNAY__PLAN_IDLE;
            continue;
        }
        p->first_vertex = (uint32_t)vertices;
        vertices += p->num_new;
        p->surplus = surplus;
        p->freed = freed;
        if (p->num_tets > own) surplus += p->num_tets - own;
        else freed += own - p->num_tets;
    }
    fresh = surplus > m->num_free ? surplus - m->num_free : 0;
    free_left = m->num_free - (delaunay_handle)(surplus - fresh);
    if (vertices > m->cap_vertices) result = delaunay__reserve_vertices(m, vertices + vertices / 2);
    if (result == DELAUNAY_OK && m->num_tets + fresh > m->cap_tets)
        result = delaunay__grow_tets(m, m->num_tets + fresh, (m->num_tets + fresh) / 2 * 3 + 64);
    if (result == DELAUNAY_OK) result = delaunay__reserve_free(m, free_left + freed);
    if (result == DELAUNAY_OK) result = delaunay__engine_slots(e, m->num_tets + fresh);
    if (result != DELAUNAY_OK) return result;
    for (i = 0; i < num; i++) {
        delaunay_plan *p = e->plans[i];
        size_t own = p->old_tets.count, next = p->surplus;
        if (p->state != DELAUNAY__PLAN_WINS) continue;
        for (j = 0; j < p->num_tets; j++)
            p->slots.items[j] = j < own ? p->old_tets.items[j]
                                : next < m->num_free
                                    ? m->free_tets[m->num_free - 1 - next++]
                                    : (delaunay_handle)(m->num_tets + (next++ - m->num_free));
        p->freed += free_left;
    }
    m->num_tets += (delaunay_handle)fresh;
    m->num_free = free_left + (delaunay_handle)freed;
    m->num_vertices = (uint32_t)vertices;
    return DELAUNAY_OK;
}

/* First half of a commit, the vertices: zeroes vertex_tet of those of the old tetrahedra and of new
 * ones, writes new ones, moves the moved ones, and puts the numbers of new ones into the plan. */
static void delaunay__commit_vertices(delaunay_engine *e, delaunay_plan *p)
{
    delaunay_mesh *m = e->mesh;
    size_t i, k;
    if (p->state != DELAUNAY__PLAN_WINS) return;
    for (i = 0; i < p->old_tets.count && m->vertex_tet; i++)
        for (k = 0; k < 4; k++)
            delaunay__atomic_set(&m->vertex_tet[m->tets[p->old_tets.items[i]].v[k]], 0);
    for (i = 0; i < p->num_new; i++) {
        delaunay_vertex *v = &m->vertices[p->first_vertex + i];
        memset(v, 0, sizeof *v);
        memcpy(v->x, p->new_xyz[i], sizeof v->x);
        m->vertex_id[p->first_vertex + i] = DELAUNAY_NO_ID;
        if (m->weight) m->weight[p->first_vertex + i] = 0;
        if (m->vertex_tet) m->vertex_tet[p->first_vertex + i] = 0;
    }
    for (i = 0; i < p->num_moved; i++)
        memcpy(m->vertices[p->moved[i]].x, p->moved_xyz[i], sizeof p->moved_xyz[i]);
    for (i = 0; i < 4 * p->num_tets; i++)
        if (p->tets[i] >= DELAUNAY_PLAN_VERTEX(DELAUNAY_PLAN_VERTICES - 1))
            p->tets[i] = p->first_vertex + (DELAUNAY_PLAN_VERTEX(0) - p->tets[i]);
}

/* Second half of a commit, the tetrahedra. */
static void delaunay__commit_tets(delaunay_engine *e, delaunay_plan *p)
{
    delaunay_mesh *m = e->mesh;
    delaunay_links links;
    size_t i;
    if (p->state != DELAUNAY__PLAN_WINS) return;
    for (i = p->num_tets; i < p->old_tets.count; i++) {
        delaunay__delete_tet(m, p->old_tets.items[i]);
        m->free_tets[p->freed + (i - p->num_tets)] = p->old_tets.items[i];
    }
    links.link = p->link;
    links.inside = p->link_inside;
    links.flags = p->link_flags;
    delaunay__replace_write(m, &links, p->color, p->tets, p->num_tets, p->slots.items);
    for (i = 0; i < p->written.count; i++) e->version[p->written.items[i]] = e->round;
    for (i = 0; i < p->num_tets; i++) e->version[p->slots.items[i]] = e->round;
    for (i = 0; i < 4 * p->num_tets && m->vertex_tet; i++)
        delaunay__atomic_max(&m->vertex_tet[p->tets[i]], p->slots.items[i / 4]);
}

/* Makes plans in the calling thread alone, as long as it does not pay to wake the others. Returns
 * their number. */
static int64_t delaunay__plan_first(delaunay_engine *e, const delaunay_speculation *job, int64_t n)
{
    const int alone = e->num_threads == 1; /* then the clock is not asked */
    double start = alone ? 0 : delaunay_seconds(&e->host), now = start;
    int64_t i;
    for (i = 0; i < n; i++) {
        if (!alone && now - start >= DELAUNAY__LEAST_ALONE && now >= e->crew.alone_until) break;
        delaunay__plan_make(e, job, e->plans[i], 0);
        if (!alone) now = delaunay_seconds(&e->host);
    }
    return i;
}

/* Makes the plans from first on, by all threads. */
static void delaunay__plan_rest(delaunay_engine *e, const delaunay_speculation *job, int64_t first,
                                int64_t n)
{
    int threads = delaunay_crew_begin(&e->crew, e->num_threads > 1);
    double work = 0;
    int64_t i;
    (void)threads;
    DELAUNAY__OMP(omp parallel num_threads(threads) reduction(+ : work))
    {
        double begin = delaunay_cpu_seconds();
        DELAUNAY__OMP(omp for schedule(dynamic, 1) nowait)
        for (i = first; i < n; i++)
            delaunay__plan_make(e, job, e->plans[i], delaunay__thread_number());
        work += delaunay_cpu_seconds() - begin;
    }
    delaunay_crew_end(&e->crew, work);
}

/* The number of threads for one short step per plan. */
static int delaunay__threads_to_share(const delaunay_engine *e, int64_t plans)
{
    int worth = e->num_threads > 1 && plans >= DELAUNAY__ALONE_PLANS &&
                delaunay_seconds(&e->host) >= e->crew.alone_until;
    return worth ? e->num_threads : 1;
}

/* Does one short step for each of n plans; the threads share them, a range each. One thread alone
 * makes no team: its start and end take longer than some steps. */
static void delaunay__each_plan(delaunay_engine *e, int64_t n, int threads,
                                void (*step)(delaunay_engine *e, size_t position))
{
    int64_t i;
    if (threads == 1) {
        for (i = 0; i < n; i++) step(e, (size_t)i);
        return;
    }
    DELAUNAY__OMP(omp parallel for schedule(static) num_threads(threads))
    for (i = 0; i < n; i++) step(e, (size_t)i);
}

static void delaunay__step_reserve(delaunay_engine *e, size_t i)
{
    delaunay__plan_reserve(e, e->plans[i], delaunay__claim(i));
}
static void delaunay__step_decide(delaunay_engine *e, size_t i)
{
    delaunay__plan_decide(e, e->plans[i], delaunay__claim(i));
}
static void delaunay__step_commit_vertices(delaunay_engine *e, size_t i)
{
    delaunay__commit_vertices(e, e->plans[i]);
}
static void delaunay__step_commit_tets(delaunay_engine *e, size_t i)
{
    delaunay__commit_tets(e, e->plans[i]);
    delaunay__plan_release_owners(e, e->plans[i]);
}

/* Makes the plans, reserves what they write, and decides which win. Shared by the threads: the mesh
 * and the versions, which are only read; the owners, written by atomic maximum, and read after all
 * have written. Each plan belongs to the thread that has its iteration. */
static void delaunay__round_plan(delaunay_engine *e, const delaunay_speculation *job, size_t num)
{
    int64_t n = (int64_t)num, first = delaunay__plan_first(e, job, n);
    int threads;
    if (first < n) delaunay__plan_rest(e, job, first, n);
    threads = delaunay__threads_to_share(e, n);
    delaunay__each_plan(e, n, threads, delaunay__step_reserve);
    delaunay__each_plan(e, n, threads, delaunay__step_decide);
}

/* Commits the winners. Their writes are disjoint except for vertex_tet (atomic); all have read the
 * old tetrahedra before new ones are written. Resets the owners to 0. */
static void delaunay__round_commit(delaunay_engine *e, size_t num)
{
    int threads = delaunay__threads_to_share(e, (int64_t)num);
    delaunay__each_plan(e, (int64_t)num, threads, delaunay__step_commit_vertices);
    delaunay__each_plan(e, (int64_t)num, threads, delaunay__step_commit_tets);
}

/* The step from one item to the next in scattered order: about 0.618 of the number of items (the
 * golden section), and coprime to it, so that all items are visited. */
static size_t delaunay__scatter_step(size_t n)
{
    size_t step = (size_t)((double)n * 0.6180339887498949), a, b, r;
    for (step = step < 1 ? 1 : step;; step++) {
        for (a = n, b = step; b; a = b, b = r) r = a % b;
        if (a == 1) return step;
    }
}

/* Calls done() for each finished item, and moves the plans of the others to the front. Returns the
 * number of the others. */
static size_t delaunay__round_finish(delaunay_engine *e, delaunay_speculation *job, size_t num,
                                     int *stop)
{
    size_t i, left = 0;
    for (i = 0; i < num; i++) {
        delaunay_plan *p = e->plans[i];
        if (p->state == DELAUNAY__PLAN_WAITS) {
            e->plans[i] = e->plans[left];
            e->plans[left++] = p;
            job->conflicts++;
            continue;
        }
        p->committed = p->state == DELAUNAY__PLAN_WINS;
        job->commits += (uint64_t)p->committed;
        if (job->done && job->done(job->user, e->mesh, e->workers[0], p->item, p)) *stop = 1;
    }
    return left;
}

/* The fraction of the phase after so many items. */
static double delaunay__fraction(const delaunay_speculation *job, size_t items)
{
    const double part = (double)items / (double)(job->num_items ? job->num_items : 1);
    return job->from + part * (job->from == 0 && job->to == 0 ? 1 : job->to - job->from);
}

DELAUNAY_API delaunay_result delaunay_speculate(delaunay_engine *engine, delaunay_speculation *job)
{
    delaunay_engine *e = engine;
    size_t batch = job->batch ? job->batch : (size_t)DELAUNAY__DEFAULT_BATCH, flight = batch,
           next = 0, num = 0, i, position = 0;
    size_t step = job->scatter && job->num_items > 1 ? delaunay__scatter_step(job->num_items) : 1;
    delaunay_result result = DELAUNAY_OK;
    int stop = 0;
    job->rounds = job->plans = job->commits = job->conflicts = 0;
    while (result == DELAUNAY_OK && !stop && (num > 0 || next < job->num_items)) {
        size_t left, more = job->num_items - next; /* done() may have raised it */
        result = delaunay__engine_plans(e, more < flight - num ? num + more : flight);
        if (result != DELAUNAY_OK) break;
        e->round++;
        for (; num < flight && next < job->num_items; next++) {
            e->plans[num]->item = job->scatter ? position : next;
            e->plans[num++]->state = DELAUNAY__PLAN_NEW;
            if (job->scatter)
                position = position >= job->num_items - step ? position - (job->num_items - step)
                                                             : position + step;
        }
        result = delaunay__engine_slots(e, e->mesh->num_tets);
        if (result != DELAUNAY_OK) break;
        delaunay__round_plan(e, job, num);
        job->rounds++;
        for (i = 0; i < num && result == DELAUNAY_OK; i++) {
            job->plans += e->plans[i]->round == e->round;
            if (e->plans[i]->state == DELAUNAY__PLAN_FAILED)
                result = (delaunay_result)e->plans[i]->committed;
        }
        if (result == DELAUNAY_OK) result = delaunay__round_assign(e, job, num);
        if (result != DELAUNAY_OK) {
            for (i = 0; i < num; i++) delaunay__plan_release_owners(e, e->plans[i]);
            break;
        }
        delaunay__round_commit(e, num);
        left = delaunay__round_finish(e, job, num, &stop);
        /* Fewer items are in flight while most of them only wait for each other. */
        if (2 * left > num)
            flight =
                num / 2 > (size_t)DELAUNAY__LEAST_BATCH ? num / 2 : (size_t)DELAUNAY__LEAST_BATCH;
        else if (4 * left < num) flight *= 2;
        if (flight > batch) flight = batch;
        if (flight < left) flight = left;
        num = left;
        if (e->host.progress &&
            e->host.progress(e->host.user, job->phase ? job->phase : "edit",
                             delaunay__fraction(job, next - num)))
            result = DELAUNAY_CANCELLED;
    }
    if (result == DELAUNAY_OK && stop) result = DELAUNAY_STOPPED_BY_BUDGET;
    return result;
}

/* ---- >>validate  a validator that trusts nothing ------------------------------------------- */
static delaunay_result delaunay__offender(delaunay_report *report, delaunay_handle t,
                                          delaunay_handle r, const char *message)
{
    if (report) {
        report->ids[0] = (uint32_t)t;
        report->ids[1] = (uint32_t)r;
        report->num_ids = r ? 2 : 1;
    }
    return delaunay__say(report, DELAUNAY_ERROR_INVALID_MESH, message);
}

/* What is wrong with facet f and its other side g; NULL: nothing. Each must be the other's
 * neighbour, with the same vertices in opposite order and the same marks. */
static const char *delaunay__check_facet(const delaunay_mesh *mesh, delaunay_handle f,
                                         delaunay_handle g)
{
    uint32_t v[3], w[3];
    int i, j;
    if (g >> 2 >= mesh->num_tets || delaunay_is_deleted(mesh, g >> 2))
        return "a neighbour that does not exist";
    if (g >> 2 == f >> 2) return "a tetrahedron is its own neighbour";
    if (mesh->tets[g >> 2].n[g & 3] != f) return "neighbours that do not know each other";
    if (f > g) return NULL; /* the rest is checked once, from the lower side */
    delaunay__get_facet(mesh, f, v);
    delaunay__get_facet(mesh, g, w);
    for (i = 0; i < 3 && v[0] != w[i]; i++) {}
    if (i == 3 || v[1] != w[(i + 2) % 3] || v[2] != w[(i + 1) % 3])
        return "neighbours whose facets do not match";
    if (!mesh->flags) return NULL;
    if (!(mesh->flags[f >> 2] & DELAUNAY_FACET_BIT(f & 3)) !=
        !(mesh->flags[g >> 2] & DELAUNAY_FACET_BIT(g & 3)))
        return "a facet constrained on one side only";
    if (!((mesh->flags[f >> 2] | mesh->flags[g >> 2]) & DELAUNAY_EDGE_BITS)) return NULL;
    for (i = 0; i < 3; i++) {
        const delaunay_tet *t = &mesh->tets[f >> 2], *r = &mesh->tets[g >> 2];
        uint32_t a = v[i], b = v[(i + 1) % 3];
        unsigned x, y;
        j = delaunay_edge_between(delaunay_local_index(t, a), delaunay_local_index(t, b));
        x = mesh->flags[f >> 2] & DELAUNAY_EDGE_BIT(j);
        j = delaunay_edge_between(delaunay_local_index(r, a), delaunay_local_index(r, b));
        y = mesh->flags[g >> 2] & DELAUNAY_EDGE_BIT(j);
        if (!x != !y) return "an edge constrained in some tetrahedra around it only";
    }
    return NULL;
}

/* What is wrong with the vertices, handles or marks of tetrahedron t; NULL: nothing. *other: the
 * neighbour concerned, or 0. */
static const char *delaunay__check_tet(const delaunay_mesh *mesh, delaunay_handle t,
                                       delaunay_handle *other)
{
    const delaunay_tet *x = &mesh->tets[t];
    int i, j;
    *other = 0;
    for (i = 0; i < 4; i++) {
        const char *why = NULL;
        if (x->v[i] >= mesh->num_vertices) return "a vertex that does not exist";
        if (x->v[i] == DELAUNAY_GHOST && i < 3) return "the ghost is not the last vertex";
        for (j = 0; j < i; j++)
            if (x->v[i] == x->v[j]) return "a vertex twice in a tetrahedron";
        if (x->n[i]) why = delaunay__check_facet(mesh, 4 * t + (delaunay_handle)i, x->n[i]);
        if (!why) continue;
        *other = x->n[i] >> 2;
        return why;
    }
    return NULL;
}

/* Checks free_tets and vertex_tet. */
static delaunay_result delaunay__check_lists(const delaunay_mesh *mesh, delaunay_report *report)
{
    delaunay_handle t;
    uint32_t v;
    for (t = 0; t < mesh->num_free; t++)
        if (mesh->free_tets[t] == 0 || mesh->free_tets[t] >= mesh->num_tets ||
            !delaunay_is_deleted(mesh, mesh->free_tets[t]))
            return delaunay__offender(report, mesh->free_tets[t], 0, "a free slot that is in use");
    for (v = 1; mesh->vertex_tet && v < mesh->num_vertices; v++) {
        t = mesh->vertex_tet[v];
        if (t && (t >= mesh->num_tets || delaunay_is_deleted(mesh, t) ||
                  delaunay_local_index(&mesh->tets[t], v) < 0))
            return delaunay__offender(report, t, 0,
                                      "vertex_tet names a tetrahedron without the vertex");
    }
    return DELAUNAY_OK;
}

/* The vertex of the neighbour across facet i of t that t does not have. */
static uint32_t delaunay__across(const delaunay_mesh *mesh, delaunay_handle t, int i)
{
    delaunay_handle n = mesh->tets[t].n[i];
    return mesh->tets[n >> 2].v[n & 3];
}

/* What is wrong with the shape of tetrahedron t, or with the hull at a ghost; NULL: nothing.
 * *other: the neighbour concerned, or 0. */
static const char *delaunay__check_shape(const delaunay_mesh *mesh, delaunay_handle t,
                                         delaunay_handle *other)
{
    int i;
    *other = 0;
    for (i = 0; i < (delaunay_is_ghost(mesh, t) ? 3 : 4); i++)
        if (!delaunay__is_finite(delaunay__corner(mesh, t, i)))
            return "a vertex that is not finite";
    if (!delaunay_is_ghost(mesh, t))
        return delaunay_orient3d(delaunay__corner(mesh, t, 0), delaunay__corner(mesh, t, 1),
                                 delaunay__corner(mesh, t, 2), delaunay__corner(mesh, t, 3)) > 0
                   ? NULL
                   : "a tetrahedron that is flat or inside out";
    for (i = 0; i < 4; i++) {
        uint32_t q;
        if (!mesh->tets[t].n[i]) return "a ghost without a neighbour";
        q = delaunay__across(mesh, t, i);
        if (q == DELAUNAY_GHOST) return "a ghost on both sides of a hull facet";
        *other = mesh->tets[t].n[i] >> 2;
        if (delaunay_orient3d(delaunay__corner(mesh, t, 0), delaunay__corner(mesh, t, 1),
                              delaunay__corner(mesh, t, 2), mesh->vertices[q].x) > 0)
            return "the hull is not convex";
        *other = 0;
    }
    return NULL;
}

static int delaunay__in_sphere(const delaunay_mesh *mesh, delaunay_handle t, uint32_t q)
{
    if (mesh->weight)
        return delaunay__in_sphere_weighted(mesh->vertices, mesh->weight, mesh->tets[t].v, q);
    return delaunay_insphere_perturbed(delaunay__corner(mesh, t, 0), delaunay__corner(mesh, t, 1),
                                       delaunay__corner(mesh, t, 2), delaunay__corner(mesh, t, 3),
                                       mesh->vertices[q].x);
}

/* Checks that tetrahedron t is locally Delaunay, under the symbolic perturbation: if all are, the
 * whole triangulation is Delaunay. NULL: it is. *other: the neighbour concerned, or 0. */
static const char *delaunay__check_spheres(const delaunay_mesh *mesh, delaunay_handle t,
                                           delaunay_handle *other)
{
    delaunay_handle r;
    int i;
    for (i = 0; i < 4; i++) {
        uint32_t q;
        if (mesh->tets[t].n[i] == 0) continue;
        q = delaunay__across(mesh, t, i);
        r = t;
        if (q == DELAUNAY_GHOST) continue;
        if (delaunay_is_ghost(mesh, t)) {
            /* next to a coplanar hull facet: test the sphere of the real neighbour */
            r = mesh->tets[t].n[3] >> 2;
            if (i == 3 || delaunay_local_index(&mesh->tets[r], q) >= 0 ||
                delaunay_orient3d(delaunay__corner(mesh, t, 0), delaunay__corner(mesh, t, 1),
                                  delaunay__corner(mesh, t, 2), mesh->vertices[q].x) != 0)
                continue;
        }
        *other = mesh->tets[t].n[i] >> 2;
        if (delaunay__in_sphere(mesh, r, q) > 0) return "a sphere that is not empty";
    }
    *other = 0;
    return NULL;
}

static const char *delaunay__check_at(const delaunay_mesh *mesh, delaunay_handle t, int level,
                                      delaunay_handle *other)
{
    return level == DELAUNAY_VALIDATE_TOPOLOGY   ? delaunay__check_tet(mesh, t, other)
           : level == DELAUNAY_VALIDATE_GEOMETRY ? delaunay__check_shape(mesh, t, other)
                                                 : delaunay__check_spheres(mesh, t, other);
}

/* Checks one level in all tetrahedra, by all threads. The offender that is reported is the lowest
 * slot, whichever thread finds it. */
static delaunay_result delaunay__check_all(const delaunay_mesh *mesh, int level, int threads,
                                           delaunay_report *report)
{
    enum { DELAUNAY__STRETCH = 4096, DELAUNAY__AHEAD = 12 };
    const int64_t num = ((int64_t)mesh->num_tets + DELAUNAY__STRETCH - 1) / DELAUNAY__STRETCH;
    delaunay_handle first = mesh->num_tets, other;
    int64_t chunk;
    DELAUNAY__OMP(omp parallel for num_threads(threads) schedule(dynamic, 1) reduction(min : first))
    for (chunk = 0; chunk < num; chunk++) {
        delaunay_handle t = (delaunay_handle)chunk * DELAUNAY__STRETCH,
                        end = t + DELAUNAY__STRETCH, unused;
        int i;
        if (end > mesh->num_tets) end = mesh->num_tets;
        for (t += t == 0; t < end && t < first; t++) {
            for (i = 0; t + DELAUNAY__AHEAD < mesh->num_tets && i < 4; i++) {
                const delaunay_tet *soon = &mesh->tets[t + DELAUNAY__AHEAD];
                if (soon->v[0] == 0) break; /* deleted: all else in it may be anything */
                if (level == DELAUNAY_VALIDATE_GEOMETRY) {
                    if (soon->v[i] < mesh->num_vertices)
                        DELAUNAY__PREFETCH(&mesh->vertices[soon->v[i]]);
                } else if (soon->n[i] >> 2 < mesh->num_tets) {
                    DELAUNAY__PREFETCH(&mesh->tets[soon->n[i] >> 2]);
                }
            }
            if (delaunay_is_deleted(mesh, t)) continue;
            if (delaunay__check_at(mesh, t, level, &unused)) first = t;
        }
    }
    (void)threads;
    if (first == mesh->num_tets) return DELAUNAY_OK;
    {
        const char *why = delaunay__check_at(mesh, first, level, &other);
        return delaunay__offender(report, first, other, why);
    }
}

DELAUNAY_API delaunay_result delaunay_validate_on(const delaunay_mesh *mesh, int level,
                                                  const delaunay_host *host,
                                                  delaunay_report *report)
{
    delaunay_result result = DELAUNAY_OK;
    int l, threads;
    if (report) memset(report, 0, sizeof *report);
    if (!mesh) return delaunay__say(report, DELAUNAY_ERROR_INVALID_ARGUMENT, "a null pointer");
    threads = delaunay_threads_for(host, (size_t)mesh->num_tets);
    if (level > DELAUNAY_VALIDATE_DELAUNAY) level = DELAUNAY_VALIDATE_DELAUNAY;
    for (l = DELAUNAY_VALIDATE_TOPOLOGY; l <= level && result == DELAUNAY_OK; l++) {
        result = delaunay__check_all(mesh, l, threads, report);
        if (l == DELAUNAY_VALIDATE_TOPOLOGY && result == DELAUNAY_OK)
            result = delaunay__check_lists(mesh, report);
    }
    return result;
}

DELAUNAY_API delaunay_result delaunay_validate(const delaunay_mesh *mesh, int level,
                                               delaunay_report *report)
{
    delaunay_host host;
    memset(&host, 0, sizeof host);
    host.num_threads = 1;
    return delaunay_validate_on(mesh, level, &host, report);
}

/* ---- >>public ----------------------------------------------------------------------------- */

DELAUNAY_API const char *delaunay_result_string(delaunay_result result)
{
    switch (result) {
    case DELAUNAY_OK:
        return "success";
    case DELAUNAY_STOPPED_BY_BUDGET:
        return "stopped by a budget; the mesh is valid";
    case DELAUNAY_GOAL_NOT_MET:
        return "a goal was not met; the mesh is valid";
    case DELAUNAY_ERROR_INVALID_ARGUMENT:
        return "invalid argument";
    case DELAUNAY_ERROR_OUT_OF_MEMORY:
        return "out of memory";
    case DELAUNAY_CANCELLED:
        return "cancelled by the caller";
    case DELAUNAY_ERROR_TOO_LARGE:
        return "too many points or tetrahedra for the index type";
    case DELAUNAY_ERROR_INTERNAL:
        return "internal error";
    case DELAUNAY_ERROR_DIMENSION:
        return "the points do not span three dimensions";
    case DELAUNAY_ERROR_NOT_FINITE:
        return "a coordinate or a weight is not finite";
    case DELAUNAY_ERROR_INVALID_MESH:
        return "the mesh is not valid";
    case DELAUNAY_ERROR_BROKEN_ARITHMETIC:
        return "floating-point arithmetic does not follow IEEE 754";
    }
    return "unknown delaunay_result";
}

/* How many NO_ID vertices come before vertex v, by a table: known[k - 1] of them come before vertex
 * k << shift. To need no memory of its own, the table is at the end of an array that is being
 * written from the front; as what is left of this shrinks, it keeps the ranks of fewer vertices. */
typedef struct delaunay__ranks {
    uint32_t *known;
    uint64_t size;
    int shift;
} delaunay__ranks;

/* Fits the table into the last `room` entries before end. */
static void delaunay__ranks_fit(delaunay__ranks *r, const delaunay_mesh *mesh, uint32_t *end,
                                uint64_t room)
{
    uint64_t v, n = mesh->num_vertices;
    uint32_t rank = 0;
    if (r->known && r->size <= room) return;
    while ((n - 1) >> r->shift > room) r->shift++;
    r->size = (n - 1) >> r->shift;
    r->known = end - r->size;
    for (v = 1; v < n; v++) {
        if ((v >> r->shift) << r->shift == v) r->known[(v >> r->shift) - 1] = rank;
        rank += mesh->vertex_id[v] == DELAUNAY_NO_ID;
    }
}

static uint32_t delaunay__rank(const delaunay__ranks *r, const delaunay_mesh *mesh, uint32_t v)
{
    const uint64_t k = (uint64_t)v >> r->shift;
    uint64_t w = k ? k << r->shift : 1;
    uint32_t rank = k ? r->known[k - 1] : 0;
    for (; w < v; w++) rank += mesh->vertex_id[w] == DELAUNAY_NO_ID;
    return rank;
}

DELAUNAY_API uint64_t delaunay_export_tets(const delaunay_mesh *mesh, uint32_t *tets,
                                           uint64_t cap_tets)
{
    uint64_t n = 0, count = 0; /* count: how many will be written, if there are several runs */
    uint32_t first = 1, last, v, id; /* first, last: of the first run of NO_ID vertices */
    delaunay__ranks ranks;
    delaunay_handle t;
    int i;
    while (first < mesh->num_vertices && mesh->vertex_id[first] != DELAUNAY_NO_ID) first++;
    last = first;
    while (last < mesh->num_vertices && mesh->vertex_id[last] == DELAUNAY_NO_ID) last++;
    for (v = last; v < mesh->num_vertices && mesh->vertex_id[v] != DELAUNAY_NO_ID; v++) {}
    if (tets && v < mesh->num_vertices) count = delaunay_count_tets(mesh);
    if (count > cap_tets) count = cap_tets;
    memset(&ranks, 0, sizeof ranks);
    for (t = 1; t < mesh->num_tets; t++) {
        if (delaunay_is_deleted(mesh, t) || delaunay_is_ghost(mesh, t)) continue;
        for (i = 0; tets && n < cap_tets && i < 4; i++) {
            v = mesh->tets[t].v[i];
            id = mesh->vertex_id[v];
            if (id == DELAUNAY_NO_ID && v < last) {
                id = mesh->num_points + v - first;
            } else if (id == DELAUNAY_NO_ID) {
                delaunay__ranks_fit(&ranks, mesh, tets + 4 * count, 4 * (count - n - 1));
                id = mesh->num_points + delaunay__rank(&ranks, mesh, v);
            }
            tets[4 * n + (uint64_t)i] = id;
        }
        n++;
    }
    return n;
}

/* Makes vertices of the caller's points, in the order of insertion. rounds[r]: the first vertex of
 * round r. */
static delaunay_result delaunay__sort(delaunay_mesh *mesh, const double *xyz, const double *weights,
                                      size_t count, int threads, hilbert_box *box, uint32_t *rounds)
{
    size_t round_begin[DELAUNAY__MAX_ROUNDS + 1];
    hxtsort_pair *items = (hxtsort_pair *)delaunay_alloc(&mesh->memory, count, sizeof *items);
    delaunay_result result = items ? DELAUNAY_OK : DELAUNAY_ERROR_OUT_OF_MEMORY;
    int distinct = 0;
    if (result == DELAUNAY_OK)
        result = delaunay__order_points(&mesh->memory, xyz, count, threads, items, box, round_begin,
                                        &distinct);
    if (result == DELAUNAY_OK) result = delaunay_reserve(mesh, count + 1, 1);
    if (result == DELAUNAY_OK) {
        mesh->vertex_of = (uint32_t *)delaunay_alloc(&mesh->memory, count, sizeof *mesh->vertex_of);
        mesh->num_points = (uint32_t)count;
        if (!mesh->vertex_of) result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    if (result == DELAUNAY_OK && weights) {
        mesh->weight = (double *)delaunay_alloc(&mesh->memory, mesh->cap_vertices, sizeof(double));
        if (!mesh->weight) result = DELAUNAY_ERROR_OUT_OF_MEMORY;
        else mesh->weight[DELAUNAY_GHOST] = 0;
    }
    if (result == DELAUNAY_OK && distinct)
        delaunay__place_distinct(mesh, xyz, weights, items, count, round_begin, rounds, threads);
    else if (result == DELAUNAY_OK)
        delaunay__place_vertices(mesh, xyz, weights, items, count, round_begin, rounds);
    delaunay_release(&mesh->memory, items);
    return result;
}

/* Inserts the rounds one after the other; vertices 1 to 4 are the first tetrahedron. */
static delaunay_result delaunay__insert_rounds(delaunay__partitions *p, const uint32_t *rounds)
{
    delaunay_mesh *mesh = p->mesh;
    uint32_t v = 5, n = mesh->num_vertices, end, i;
    int r, result = DELAUNAY_OK;
    size_t largest = 0;
    const hilbert_box unbent = p->box;
    uint64_t attempt = 0;
    for (r = 0; r < DELAUNAY__MAX_ROUNDS; r++)
        largest = rounds[r + 1] - rounds[r] > largest ? rounds[r + 1] - rounds[r] : largest;
    p->items = (hxtsort_pair32 *)delaunay_alloc(&mesh->memory, largest, sizeof *p->items);
    if (!p->items) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    for (r = 0; r < DELAUNAY__MAX_ROUNDS && result == DELAUNAY_OK && v < n; r++, v = end) {
        end = rounds[r + 1] > v ? rounds[r + 1] : v;
        if (end > n) end = n;
        if (attempt != p->attempt && v < end) { /* an earlier round has replaced the keys */
            p->box = unbent;
            attempt = p->attempt;
            delaunay__rekey(p, v);
        }
        for (i = v; i < end; i++) {
            p->items[i - v].key = mesh->vertices[i].key;
            p->items[i - v].value = i;
        }
        result = delaunay__run_round(p, end, end - v);
    }
    return (delaunay_result)result;
}

/* Makes the first tetrahedron and inserts the other vertices. Round r begins at rounds[r]. */
static delaunay_result delaunay__insert_all(delaunay_mesh *mesh, const uint32_t *rounds,
                                            const hilbert_box *box, const delaunay_options *options)
{
    delaunay__partitions p;
    delaunay_partition job;
    int i;
    size_t n = mesh->num_vertices;
    delaunay_result result, finished;
    size_t slots = 7 * n + 1024;
    if (delaunay_threads(&options->host) > 1)
        slots += 2 * DELAUNAY__SLOTS_AT_ONCE * (size_t)delaunay_threads(&options->host);
    result = delaunay__reserve_tets(mesh, slots);
    if (result != DELAUNAY_OK) return result;
    memset(&job, 0, sizeof job);
    delaunay__first_tet(mesh);
    result =
        delaunay__partitions_init(&p, mesh, &job, &options->host, delaunay__exact_in_doubles(mesh));
    p.box = *box;
    p.box.depth = 0;
    p.all = (double)n;
    if (result == DELAUNAY_OK && p.num_kernels > 1) delaunay__rekey(&p, mesh->num_vertices);
    if (result == DELAUNAY_OK) result = delaunay__insert_rounds(&p, rounds);
    for (i = 0; i < p.num_kernels && result == DELAUNAY_OK; i++) {
        finished = delaunay__kernel_finish(p.kernels[i]);
        result = finished;
    }
    delaunay_release(&mesh->memory, p.items);
    delaunay__partitions_free(&p);
    return result;
}

/* Updates vertex_of after vertices were swapped. Scratch: vertices[v].local is the old number of v,
 * vertices[old].key the new number of that vertex. */
static void delaunay__renew_vertex_of(delaunay_mesh *mesh)
{
    uint32_t i, v;
    for (v = 1; v < mesh->num_vertices; v++)
        mesh->vertices[v].local = mesh->vertex_of[mesh->vertex_id[v]];
    for (v = 1; v < mesh->num_vertices; v++) mesh->vertices[mesh->vertices[v].local].key = v;
    for (i = 0; i < mesh->num_points; i++)
        mesh->vertex_of[i] = mesh->vertices[mesh->vertex_of[i]].key;
    for (v = 1; v < mesh->num_vertices; v++) mesh->vertices[v].local = mesh->vertices[v].key = 0;
}

/* The number of real tetrahedra in slots [1, end) of a mesh in canonical order, where they come
 * before the ghosts. */
static int64_t delaunay__count_real(const delaunay_mesh *mesh, int64_t end)
{
    int64_t lo = 1;
    while (lo < end) {
        int64_t t = lo + (end - lo) / 2;
        if (mesh->tets[t].v[3] == DELAUNAY_GHOST) end = t;
        else lo = t + 1;
    }
    return lo - 1;
}

/* Counts tetrahedra and ghosts for the report, and clears the scratch fields of the vertices, whose
 * values may depend on the number of threads. */
static void delaunay__count(delaunay_mesh *mesh, delaunay_report *report, int canonical,
                            int threads)
{
    int64_t t, num_tets = (int64_t)mesh->num_tets, num_vertices = mesh->num_vertices, real = 0,
               ghosts = 0;
    (void)threads;
    if (canonical && num_tets) {
        real = delaunay__count_real(mesh, num_tets);
        ghosts = num_tets - 1 - real;
    } else {
        DELAUNAY__OMP(omp parallel for num_threads(threads) schedule(static)                       \
                      reduction(+ : real, ghosts))
        for (t = 1; t < num_tets; t++) {
            const uint32_t *v = mesh->tets[t].v;
            real += v[0] != 0 && v[3] != 0;
            ghosts += v[0] != 0 && v[3] == 0;
        }
    }
    DELAUNAY__OMP(omp parallel for num_threads(threads) schedule(static))
    for (t = 0; t < num_vertices; t++) mesh->vertices[t].key = mesh->vertices[t].local = 0;
    report->num_tets = (uint64_t)real;
    report->num_ghosts = (uint64_t)ghosts;
}

/* Points and weights as packed doubles: the caller's arrays, or copies that are to be released. */
typedef struct delaunay__packed {
    const double *xyz, *weights;
    double *copy_xyz, *copy_weights;
} delaunay__packed;

/* A packed copy of count rows with per values each, stride bytes apart; NULL: out of memory. */
static double *delaunay__pack(delaunay_memory *memory, const void *data, size_t count, size_t per,
                              size_t stride, int is_float)
{
    double *copy = (double *)delaunay_alloc(memory, count, per * sizeof *copy);
    size_t i, k;
    for (i = 0; copy && i < count; i++) {
        const char *row = (const char *)data + i * stride;
        for (k = 0; k < per; k++) {
            float f;
            if (is_float) {
                memcpy(&f, row + k * sizeof f, sizeof f);
                copy[per * i + k] = (double)f;
            } else {
                memcpy(&copy[per * i + k], row + k * sizeof *copy, sizeof *copy);
            }
        }
    }
    return copy;
}

static delaunay_result delaunay__unpack(delaunay__packed *packed, delaunay_memory *memory,
                                        const delaunay_points *points)
{
    size_t value = points->is_float ? sizeof(float) : sizeof(double);
    size_t stride = points->stride ? points->stride : 3 * value;
    size_t weight_stride = points->weight_stride ? points->weight_stride : value;
    memset(packed, 0, sizeof *packed);
    packed->xyz = (const double *)points->xyz;
    packed->weights = (const double *)points->weights;
    if (points->count && (points->is_float || stride != 3 * value || (uintptr_t)points->xyz % 8)) {
        packed->xyz = packed->copy_xyz =
            delaunay__pack(memory, points->xyz, points->count, 3, stride, points->is_float);
        if (!packed->xyz) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    if (points->count && points->weights &&
        (points->is_float || weight_stride != value || (uintptr_t)points->weights % 8)) {
        packed->weights = packed->copy_weights =
            delaunay__pack(memory, points->weights, points->count, 1, weight_stride,
                           points->is_float);
        if (!packed->weights) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    }
    return DELAUNAY_OK;
}

/* The first weight that is not finite, into the report. */
static delaunay_result delaunay__check_weights(const delaunay__packed *packed, size_t count,
                                               delaunay_report *report)
{
    size_t i;
    for (i = 0; packed->weights && i < count; i++) {
        if (packed->weights[i] - packed->weights[i] == 0) continue;
        report->ids[report->num_ids++] = (uint32_t)i;
        memcpy(report->xyz, packed->xyz + 3 * i, sizeof report->xyz);
        snprintf(report->message, sizeof report->message,
                 "point %lu at (%.9g, %.9g, %.9g): its weight is not finite", (unsigned long)i,
                 report->xyz[0], report->xyz[1], report->xyz[2]);
        return DELAUNAY_ERROR_NOT_FINITE;
    }
    return DELAUNAY_OK;
}

/* Checks the caller's points and makes vertices of them, in the order of insertion; fills in the
 * counts and the dimension of the report. */
static delaunay_result delaunay__take_points(delaunay_mesh *mesh, const delaunay_points *points,
                                             const delaunay_options *options, hilbert_box *box,
                                             uint32_t *rounds, delaunay_report *report)
{
    delaunay__packed packed;
    size_t count = points->count;
    delaunay_result result = delaunay__unpack(&packed, &mesh->memory, points);
    if (result == DELAUNAY_OK)
        result = delaunay__check_finite(packed.xyz, count, 0, &options->host, report);
    if (result == DELAUNAY_OK) result = delaunay__check_weights(&packed, count, report);
    if (result == DELAUNAY_OK)
        result = delaunay__sort(mesh, packed.xyz, packed.weights, count,
                                delaunay_threads(&options->host), box, rounds);
    delaunay_release(&mesh->memory, packed.copy_xyz);
    delaunay_release(&mesh->memory, packed.copy_weights);
    if (result != DELAUNAY_OK) return result;
    report->num_vertices = mesh->num_vertices - 1;
    report->num_duplicates = count - report->num_vertices;
    report->dimension = delaunay__first_four(mesh);
    if (report->dimension < 3) return DELAUNAY_ERROR_DIMENSION;
    if (report->num_duplicates) delaunay__renew_vertex_of(mesh);
    return DELAUNAY_OK;
}

/* Sets local of each vertex to 1 if it is in a tetrahedron, else to 0. */
static void delaunay__mark_used(delaunay_mesh *mesh)
{
    delaunay_handle t;
    uint32_t v;
    int i;
    for (v = 0; v < mesh->num_vertices; v++) mesh->vertices[v].local = 0;
    for (t = 1; t < mesh->num_tets; t++)
        for (i = 0; i < 4 && !delaunay_is_deleted(mesh, t); i++)
            mesh->vertices[mesh->tets[t].v[i]].local = 1;
}

/* Counts the vertices that are in no tetrahedron, and sets vertex_of to 0 for their points. */
static void delaunay__hide(delaunay_mesh *mesh, delaunay_report *report)
{
    uint32_t v;
    size_t i;
    delaunay__mark_used(mesh);
    for (v = 1; v < mesh->num_vertices; v++) report->num_hidden += !mesh->vertices[v].local;
    for (i = 0; i < mesh->num_points; i++)
        if (!mesh->vertices[mesh->vertex_of[i]].local) mesh->vertex_of[i] = 0;
    for (v = 0; v < mesh->num_vertices; v++) mesh->vertices[v].local = 0;
}

static const char delaunay__no_host[] = "a number of threads below 0, or half an allocator";

DELAUNAY_API delaunay_result delaunay_tetrahedralize_points(delaunay_mesh *mesh,
                                                            const delaunay_points *points,
                                                            const delaunay_options *options,
                                                            delaunay_report *report)
{
    delaunay_options local;
    delaunay_report unused;
    delaunay_memory memory;
    delaunay_result result;
    double start, sorted, inserted;
    uint32_t rounds[DELAUNAY__MAX_ROUNDS + 1];
    hilbert_box box;
    if (!report) report = &unused;
    memset(report, 0, sizeof *report);
    memset(&local, 0, sizeof local);
    report->dimension = -1;
    if (options) local = *options;
    options = &local;
    if (!mesh || !points || (points->count && !points->xyz))
        return delaunay__say(report, DELAUNAY_ERROR_INVALID_ARGUMENT, "a null pointer");
    if (delaunay_memory_init(&memory, &options->host) != DELAUNAY_OK)
        return delaunay__say(report, DELAUNAY_ERROR_INVALID_ARGUMENT, delaunay__no_host);
    delaunay_mesh_free(mesh);
    if (points->count >= UINT32_MAX - 16)
        return delaunay__say(report, DELAUNAY_ERROR_TOO_LARGE, "too many points");
    start = sorted = inserted = delaunay_seconds(&options->host);
    report->num_points = points->count;
    mesh->memory = memory;
    if (points->count < (size_t)delaunay_threads(&local.host) * DELAUNAY__ITEMS_A_SECTION)
        local.host.num_threads = 1 + (int)(points->count / (2 * DELAUNAY__ITEMS_A_SECTION));
    result = delaunay__take_points(mesh, points, options, &box, rounds, report);
    sorted = inserted = delaunay_seconds(&options->host);
    if (result == DELAUNAY_OK) result = delaunay__insert_all(mesh, rounds, &box, options);
    inserted = delaunay_seconds(&options->host);
    if (result == DELAUNAY_OK && !options->any_order)
        result = delaunay_canonicalize(mesh, &options->host);
    report->seconds_sort = sorted - start;
    report->seconds_insert = inserted - sorted;
    report->peak_bytes = mesh->memory.peak_bytes;
    if (result != DELAUNAY_OK) {
        delaunay_mesh_free(mesh);
        if (report->message[0]) return result;
        return delaunay__say(report, result, delaunay_result_string(result));
    }
    delaunay__count(mesh, report, !options->any_order, delaunay_threads(&options->host));
    if (mesh->weight) delaunay__hide(mesh, report);
    report->seconds_finish = delaunay_seconds(&options->host) - inserted;
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_tetrahedralize(delaunay_mesh *mesh, const double *xyz,
                                                     size_t count, const delaunay_options *options,
                                                     delaunay_report *report)
{
    delaunay_points points;
    memset(&points, 0, sizeof points);
    points.xyz = xyz;
    points.count = count;
    return delaunay_tetrahedralize_points(mesh, &points, options, report);
}

/* -- delaunay_insert: many points into a mesh */

/* A hash table of vertices by their coordinates; open addressing, 0: free. */
typedef struct delaunay__places {
    uint32_t *table;
    size_t mask;
} delaunay__places;

/* The entry for these coordinates: the vertex there, or 0, for the caller to set. */
static uint32_t *delaunay__place(const delaunay__places *p, const delaunay_mesh *mesh,
                                 const double *xyz)
{
    size_t i = (size_t)delaunay__hash_point(xyz) & p->mask;
    while (p->table[i] && delaunay__compare_points(mesh->vertices[p->table[i]].x, xyz) != 0)
        i = (i + 1) & p->mask;
    return &p->table[i];
}

/* Enters all vertices, and leaves room for so many more. Of two vertices at the same place the one
 * that is in a tetrahedron (local is 1) is entered. */
static delaunay_result delaunay__places_init(delaunay__places *p, delaunay_mesh *mesh, size_t more)
{
    uint32_t v;
    p->mask = 255;
    while (p->mask < 2 * (mesh->num_vertices + more)) p->mask = 2 * p->mask + 1;
    p->table = (uint32_t *)delaunay_alloc_zeroed(&mesh->memory, p->mask + 1, sizeof *p->table);
    if (!p->table) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    for (v = 1; v < mesh->num_vertices; v++) {
        uint32_t *entry = delaunay__place(p, mesh, mesh->vertices[v].x);
        if (!*entry || mesh->vertices[v].local) *entry = v;
    }
    return DELAUNAY_OK;
}

/* The vertices to be inserted, round by round; those of round r begin at vertices[begin[r]]. */
typedef struct delaunay__insertion {
    uint32_t *vertices, begin[DELAUNAY__MAX_ROUNDS + 1];
} delaunay__insertion;

/* Assigns to each point the vertex at its place, or a new one, and appends it to vertex_of. Lists
 * the vertices that are in no tetrahedron (local is 0) for insertion, and sets their local. */
static void delaunay__assign_vertices(delaunay_mesh *mesh, const delaunay__places *places,
                                      const double *xyz, const hxtsort_pair *items, size_t count,
                                      const size_t *round_begin, delaunay__insertion *insertion)
{
    uint32_t listed = 0, first = mesh->num_points;
    size_t i;
    int r = 0;
    for (i = 0; i < count; i++) {
        const double *x = xyz + 3 * items[i].value;
        uint32_t *entry = delaunay__place(places, mesh, x);
        while (r < DELAUNAY__MAX_ROUNDS && round_begin[r] <= i) insertion->begin[r++] = listed;
        if (!*entry) *entry = delaunay_add_vertex(mesh, x, first + (uint32_t)items[i].value);
        if (!mesh->vertices[*entry].local) insertion->vertices[listed++] = *entry;
        mesh->vertices[*entry].local = 1;
        mesh->vertex_of[first + items[i].value] = *entry;
    }
    while (r <= DELAUNAY__MAX_ROUNDS) insertion->begin[r++] = listed;
    mesh->num_points = first + (uint32_t)count;
}

/* Takes the points in sorted order; on failure the mesh has no new vertices. */
static delaunay_result delaunay__append_vertices(delaunay_mesh *mesh, const double *xyz,
                                                 const hxtsort_pair *items, size_t count,
                                                 const size_t *round_begin,
                                                 delaunay__insertion *insertion)
{
    delaunay__places places;
    uint32_t *vertex_of, n = mesh->num_points, v;
    delaunay_result result = delaunay_reserve(mesh, mesh->num_vertices + count, 1);
    if (result != DELAUNAY_OK) return result;
    vertex_of = (uint32_t *)delaunay_grow(&mesh->memory, mesh->vertex_of, n, n + count,
                                          sizeof *vertex_of);
    if (!vertex_of) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    mesh->vertex_of = vertex_of;
    insertion->vertices =
        (uint32_t *)delaunay_alloc(&mesh->memory, count, sizeof *insertion->vertices);
    if (!insertion->vertices) return DELAUNAY_ERROR_OUT_OF_MEMORY;
    delaunay__mark_used(mesh);
    result = delaunay__places_init(&places, mesh, count);
    if (result == DELAUNAY_OK) {
        delaunay__assign_vertices(mesh, &places, xyz, items, count, round_begin, insertion);
        delaunay_release(&mesh->memory, places.table);
    }
    for (v = 0; v < mesh->num_vertices; v++) mesh->vertices[v].local = 0;
    return result;
}

/* Inserts the rounds, each as a job of engine (a). */
static delaunay_result delaunay__insert_more(delaunay_mesh *mesh,
                                             const delaunay__insertion *insertion,
                                             const delaunay_host *host)
{
    delaunay_partition job;
    delaunay_result result = DELAUNAY_OK;
    int r;
    for (r = 0; r < DELAUNAY__MAX_ROUNDS && result == DELAUNAY_OK; r++) {
        memset(&job, 0, sizeof job);
        job.vertices = insertion->vertices + insertion->begin[r];
        job.num_vertices = insertion->begin[r + 1] - insertion->begin[r];
        if (job.num_vertices) result = delaunay_partition_run(mesh, &job, host);
    }
    return result;
}

/* Sorts the points, appends vertices, inserts them, updates vertex_tet and canonicalizes; fills in
 * the seconds of the report. */
static delaunay_result delaunay__insert_points(delaunay_mesh *mesh, const double *xyz, size_t count,
                                               const delaunay_options *options,
                                               delaunay_report *report)
{
    size_t round_begin[DELAUNAY__MAX_ROUNDS + 1];
    delaunay__insertion insertion;
    hilbert_box box;
    double start = delaunay_seconds(&options->host), sorted, inserted;
    int distinct;
    hxtsort_pair *items = (hxtsort_pair *)delaunay_alloc(&mesh->memory, count, sizeof *items);
    delaunay_result result = items ? DELAUNAY_OK : DELAUNAY_ERROR_OUT_OF_MEMORY;
    memset(&insertion, 0, sizeof insertion);
    if (result == DELAUNAY_OK)
        result = delaunay__order_points(&mesh->memory, xyz, count, delaunay_threads(&options->host),
                                        items, &box, round_begin, &distinct);
    if (result == DELAUNAY_OK)
        result = delaunay__append_vertices(mesh, xyz, items, count, round_begin, &insertion);
    delaunay_release(&mesh->memory, items);
    sorted = inserted = delaunay_seconds(&options->host);
    if (result == DELAUNAY_OK) {
        report->num_duplicates = count - insertion.begin[DELAUNAY__MAX_ROUNDS];
        result = delaunay__insert_more(mesh, &insertion, &options->host);
        inserted = delaunay_seconds(&options->host);
        if (mesh->vertex_tet) { /* also after a failure, for the points that were inserted */
            delaunay_result linked = delaunay_link_vertices(mesh);
            if (result == DELAUNAY_OK) result = linked;
        }
    }
    delaunay_release(&mesh->memory, insertion.vertices);
    if (result == DELAUNAY_OK && !options->any_order)
        result = delaunay_canonicalize(mesh, &options->host);
    report->seconds_sort = sorted - start;
    report->seconds_insert = inserted - sorted;
    report->seconds_finish = delaunay_seconds(&options->host) - inserted;
    return result;
}

DELAUNAY_API delaunay_result delaunay_insert(delaunay_mesh *mesh, const double *xyz, size_t count,
                                             const delaunay_options *options,
                                             delaunay_report *report)
{
    delaunay_options defaults;
    delaunay_report unused;
    delaunay_memory memory;
    delaunay_result result;
    if (!report) report = &unused;
    memset(&defaults, 0, sizeof defaults);
    if (!options) options = &defaults;
    if (mesh && !mesh->tets) return delaunay_tetrahedralize(mesh, xyz, count, options, report);
    memset(report, 0, sizeof *report);
    report->dimension = 3;
    report->num_points = count;
    if (!mesh || (count && !xyz) || mesh->flags || mesh->color || mesh->weight ||
        !delaunay__is_closed(mesh))
        return delaunay__say(report, DELAUNAY_ERROR_INVALID_ARGUMENT,
                             "a null pointer, or a mesh with marks, weights, or no hull");
    if (delaunay_memory_init(&memory, &options->host) != DELAUNAY_OK)
        return delaunay__say(report, DELAUNAY_ERROR_INVALID_ARGUMENT, delaunay__no_host);
    if (count >= UINT32_MAX - 16 - (mesh->num_vertices > mesh->num_points ? mesh->num_vertices
                                                                          : mesh->num_points))
        return delaunay__say(report, DELAUNAY_ERROR_TOO_LARGE, "too many points");
    mesh->memory.limit_bytes = options->host.memory_limit_bytes;
    result = delaunay__check_finite(xyz, count, mesh->num_points, &options->host, report);
    if (result == DELAUNAY_OK && count)
        result = delaunay__insert_points(mesh, xyz, count, options, report);
    report->num_points = mesh->num_points;
    report->num_vertices = mesh->num_vertices - 1;
    report->peak_bytes = mesh->memory.peak_bytes;
    delaunay__count(mesh, report, 0, delaunay_threads(&options->host));
    if (result == DELAUNAY_OK || report->message[0]) return result;
    return delaunay__say(report, result, delaunay_result_string(result));
}

#endif /* DELAUNAY_IMPLEMENTATION */

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
