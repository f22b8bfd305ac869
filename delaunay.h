/* delaunay.h - v0.1.0 - exact 3D Delaunay triangulation, and the mesh engine that mesher.h and spr.h stand on
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
 *   >>build           order of insertion, duplicates, canonical numbering
 *   >>partitions      engine (a): sections of the Moore curve    [Marot 2020, 4.2-4.6]
 *   >>editing         stars, replacement of a cavity, constraint marks, locate
 *   >>reconnect       closure search over small polyhedra        [Marot 2020, 6.2]
 *   >>speculate       engine (b): plan on a frozen mesh, reserve, commit
 *   >>validate        a validator that trusts nothing
 *   >>public          the everyday functions
 *
 * WHAT IT DOES NOT DO: no constraints (mesher.h), no quality (spr.h), no 2D meshes.
 *
 * HOW IT WORKS
 *   A mesh is two arrays. vertices[0] is the ghost, the vertex at infinity that closes the hull (thesis
 *   3.7); the caller's points are vertices 1 .. num_vertices-1, in the order of the curve. tets[0] is a
 *   dummy, so that handle 0 means "none". A tetrahedron is a record of four vertices and four handles; the
 *   handle 4*t+i names facet i of tetrahedron t, the one opposite its vertex i, and tets[t].n[i] is the same
 *   facet seen from the other side. Facets in outward order: {1,2,3} {0,3,2} {0,1,3} {0,2,1}.
 *   The determinant det(b-a, c-a, d-a) of a tetrahedron (a,b,c,d) is positive. A ghost tetrahedron has
 *   the ghost as its last vertex, and its first three see the outside: (a,b,c,q) is positive for a point q
 *   beyond the hull facet. A deleted tetrahedron has v[0] == 0.
 *   Cospherical points are decided by a perturbation of the lifting in lexicographic order of the coordinates:
 *   the triangulation is a function of the set of points, whatever their order or the number of threads.
 *
 * COMPILE-TIME SWITCHES
 *   DELAUNAY_IMPLEMENTATION   implementation file  the bodies (and those of hilbert.h and hxtsort.h)
 *   DELAUNAY_NO_DEPENDENCIES  implementation file  another file has the bodies of hilbert.h and hxtsort.h
 *   DELAUNAY_STATIC           implementation file  everything static
 *   DELAUNAY_NO_SIMD          implementation file  plain C only; same results
 *   DELAUNAY_INDEX64          whole program        64-bit handles: more than 2^30 tetrahedra
 *
 * LICENCE: MIT or public domain, at the end of the file.
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

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(_M_FP_FAST)
#  error "delaunay.h: exact predicates need IEEE arithmetic; compile without -ffast-math and -Ofast"
#endif
#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0
#  error "delaunay.h: exact predicates need doubles without excess precision (x87: use -mfpmath=sse)"
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

/* Files compiled with different layouts must not link silently. */
#ifdef DELAUNAY_INDEX64
#  define delaunay_tetrahedralize delaunay_tetrahedralize_index64
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- >>types ------------------------------------------------------------------------------ */

/* 0: success. Positive: the mesh is valid, but a goal or a budget of the caller was not met.
 * Negative: failure; -1..-15 mean the same in the whole family, so a code of another header passes by a cast. */
typedef enum delaunay_result {
    DELAUNAY_OK                       = 0,
    DELAUNAY_STOPPED_BY_BUDGET        = 1,  /* valid; the report says which budget */
    DELAUNAY_GOAL_NOT_MET             = 2,  /* valid; the report says which goal */
    DELAUNAY_ERROR_INVALID_ARGUMENT   = -1,
    DELAUNAY_ERROR_OUT_OF_MEMORY      = -2,
    DELAUNAY_CANCELLED                = -3,
    DELAUNAY_ERROR_TOO_LARGE          = -4, /* a count beyond what indices can hold */
    DELAUNAY_ERROR_INTERNAL           = -5, /* a belief of this library did not hold: please report */
    DELAUNAY_ERROR_DIMENSION          = -48, /* the points span 0, 1 or 2 dimensions: report->dimension */
    DELAUNAY_ERROR_NOT_FINITE         = -49, /* NaN or infinity among the coordinates: report->ids */
    DELAUNAY_ERROR_RANGE              = -50, /* coordinates beyond the exact range: report->ids */
    DELAUNAY_ERROR_INVALID_MESH       = -51, /* the validator found an offender: report */
    DELAUNAY_ERROR_BROKEN_ARITHMETIC  = -52  /* the self-test failed: compiler flags or FPU mode */
} delaunay_result;

typedef hxtsort_allocator delaunay_allocator; /* {alloc, release, user}; all zero: malloc and free */

enum { DELAUNAY_LOG_ERROR, DELAUNAY_LOG_WARNING, DELAUNAY_LOG_INFO, DELAUNAY_LOG_DEBUG };

/* What the host program lends to a call; zeros are the recommended setting.
 * The callbacks are called by the calling thread only. */
typedef struct delaunay_host {
    delaunay_allocator allocator;
    size_t             memory_limit_bytes;  /* 0: none; beyond it allocations fail */
    int                num_threads;         /* 0: omp_get_max_threads() at each call */
    void (*log)(void *user, int level, const char *text);              /* NULL: silent */
    int  (*progress)(void *user, const char *phase, double fraction);  /* nonzero return cancels */
    double (*clock)(void *user);            /* seconds; NULL: omp_get_wtime(), else clock() */
    void              *user;
} delaunay_host;

/* Account of one object's allocations. Expert: delaunay_alloc and its companions. */
typedef struct delaunay_memory {
    delaunay_allocator allocator; /* resolved */
    size_t             limit_bytes, bytes, peak_bytes;
} delaunay_memory;

#ifdef DELAUNAY_INDEX64
typedef uint64_t delaunay_handle; /* a tetrahedron t, or one of its facets 4*t+i */
#else
typedef uint32_t delaunay_handle;
#endif

#define DELAUNAY_GHOST      0u          /* the vertex at infinity */
#define DELAUNAY_NONE       0u          /* no tetrahedron, no facet */
#define DELAUNAY_NO_ID      UINT32_MAX  /* id of a vertex that the caller did not give */
#define DELAUNAY_OUTSIDE    0u          /* colour of what is outside every region */

typedef struct delaunay_vertex {
    double   x[3];
    uint32_t key;   /* of the running stage: top bits of the Moore key in engine (a) */
    uint32_t local; /* of the running stage: number within a cavity */
} delaunay_vertex;

typedef struct delaunay_tet {
    uint32_t        v[4]; /* vertices; v[3] == 0: ghost tetrahedron; v[0] == 0: deleted */
    delaunay_handle n[4]; /* n[i]: the facet of the neighbour that is facet i; 0: none */
} delaunay_tet;

/* Bits of delaunay_mesh.flags[t]. Both sides of a facet, and all tetrahedra around an edge, agree. */
#define DELAUNAY_FACET_BIT(i)  (1u << (i))         /* facet i is constrained */
#define DELAUNAY_FACET_BITS    0xfu
#define DELAUNAY_EDGE_BIT(e)   (1u << (4 + (e)))   /* edge e is constrained; order (01)(02)(03)(12)(13)(23) */
#define DELAUNAY_EDGE_BITS     0x3f0u
#define DELAUNAY_STAGE_BITS    0xfc00u             /* free for the running stage; 0 in a new tetrahedron */

/* The mesh object: open arrays, read them directly. Zero-initialise before first use.
 * Any call that may add vertices or tetrahedra may move the arrays. */
typedef struct delaunay_mesh {
    delaunay_vertex *vertices;     /* [0] is the ghost */
    uint32_t        *vertex_id;    /* the caller's index of each vertex; DELAUNAY_NO_ID: added by us */
    delaunay_handle *vertex_tet;   /* a tetrahedron of each vertex's star; NULL until delaunay_link_vertices */
    uint32_t         num_vertices; /* the ghost counted */
    uint32_t         cap_vertices;

    delaunay_tet    *tets;         /* [0] is a dummy */
    uint16_t        *flags;        /* constraint and stage bits; NULL until delaunay_enable_marks */
    uint32_t        *color;        /* region of each tetrahedron; NULL until delaunay_enable_marks */
    uint8_t         *mark;         /* scratch of the kernel, one byte a tetrahedron; 0 between calls */
    delaunay_handle  num_tets;     /* slots in use, the dummy and deleted ones counted */
    delaunay_handle  cap_tets;
    delaunay_handle *free_tets;    /* deleted slots, last in first out */
    delaunay_handle  num_free;
    delaunay_handle  cap_free;

    uint32_t        *vertex_of;    /* caller's point -> vertex; a duplicate has its survivor's */
    uint32_t         num_points;   /* length of vertex_of */

    delaunay_memory  memory;
} delaunay_mesh;

typedef struct delaunay_options {
    delaunay_host host;
    int any_order;       /* nonzero: leave tetrahedra as they were made, not in canonical order (faster) */
} delaunay_options;

/* What happened and where. Every function that takes a report overwrites it whole. */
typedef struct delaunay_report {
    uint64_t num_points, num_vertices, num_duplicates; /* duplicates: equal in all three coordinates */
    uint64_t num_tets, num_ghosts;
    int      dimension;                     /* affine dimension of the points, -1: none, .. 3 */
    uint32_t ids[4]; int num_ids;           /* offenders: caller's point ids, or tetrahedra for the validator */
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
 *   mesh     in/out  zeroed, or a mesh to be replaced; on failure freed and zeroed
 *   xyz      in      3*count doubles, finite; not kept
 *   count    in      below 2^32 - 16
 *   options  in      NULL or zeroed: defaults
 *   report   out     may be NULL
 *
 * Returns  DELAUNAY_OK; _ERROR_DIMENSION: fewer than 4 affinely independent points (report->dimension);
 *          _ERROR_NOT_FINITE, _ERROR_RANGE with ids; _ERROR_OUT_OF_MEMORY; _CANCELLED
 * Threads  options->host.num_threads; distinct meshes may run at once
 * Repeats  same bytes for the same set of points in the same order, any number of threads
 * Source   Marot 2020, chapters 3 and 4
 */
DELAUNAY_API delaunay_result delaunay_tetrahedralize(delaunay_mesh *mesh, const double *xyz, size_t count,
                                                     const delaunay_options *options, delaunay_report *report);

/* Frees all arrays and zeroes the object. Accepts a zeroed one. */
DELAUNAY_API void delaunay_mesh_free(delaunay_mesh *mesh);

/* Number of real tetrahedra: neither ghost nor deleted. O(slots). */
DELAUNAY_API uint64_t delaunay_count_tets(const delaunay_mesh *mesh);

/* The real tetrahedra as caller's point ids, in canonical order of the slots; returns their number.
 * tets may be NULL to count; vertices added by us get ids from num_points on, in order of the array. */
DELAUNAY_API uint64_t delaunay_export_tets(const delaunay_mesh *mesh, uint32_t *tets, uint64_t cap_tets);

/* Levels of delaunay_validate; each includes those before. */
enum {
    DELAUNAY_VALIDATE_TOPOLOGY,   /* handles mutual, shared triples opposite, no deleted neighbour, marks agree */
    DELAUNAY_VALIDATE_GEOMETRY,   /* every real tetrahedron positive, exactly; ghosts on the hull (if any) */
    DELAUNAY_VALIDATE_DELAUNAY    /* every facet locally Delaunay, perturbed: the whole mesh is */
};
/* Proves what the level lists, or returns DELAUNAY_ERROR_INVALID_MESH with the first offender in the report. */
DELAUNAY_API delaunay_result delaunay_validate(const delaunay_mesh *mesh, int level, delaunay_report *report);

/* ---- >>expert ------------------------------------------------------------------------------
 * What mesher.h and spr.h are built on; stable names, sharper edges. */

/* -- memory: overflow-checked, counted, 64-byte aligned; NULL on failure. release accepts NULL. */
DELAUNAY_API delaunay_result delaunay_memory_init(delaunay_memory *memory, const delaunay_host *host);
DELAUNAY_API void *delaunay_alloc(delaunay_memory *memory, size_t count, size_t size);
/* The first keep elements of old, in room for count; old is released on success and untouched on failure. */
DELAUNAY_API void *delaunay_grow(delaunay_memory *memory, void *old, size_t keep, size_t count, size_t size);
DELAUNAY_API void  delaunay_release(delaunay_memory *memory, void *block);
/* Seconds by the host's clock; differences count. */
DELAUNAY_API double delaunay_seconds(const delaunay_host *host);
/* Threads that a call with this host uses at most. */
DELAUNAY_API int delaunay_threads(const delaunay_host *host);

/* -- predicates. Points are three doubles. Signs are exact: -1, 0, 1. */

/* Sign of det(b-a, c-a, d-a): positive for a valid tetrahedron (a,b,c,d). */
DELAUNAY_API int delaunay_orient3d(const double *a, const double *b, const double *c, const double *d);
/* Positive: e inside the sphere through the positive tetrahedron (a,b,c,d). */
DELAUNAY_API int delaunay_insphere(const double *a, const double *b, const double *c, const double *d,
                                   const double *e);
/* The same, ties decided by the symbolic perturbation: never 0 for five distinct points. */
DELAUNAY_API int delaunay_insphere_perturbed(const double *a, const double *b, const double *c,
                                             const double *d, const double *e);
/* The test behind orient3d's filter: always exact, slower. */
DELAUNAY_API int delaunay_orient3d_exact(const double *a, const double *b, const double *c, const double *d);
/* True if a, b, c lie on one line, exactly. */
DELAUNAY_API int delaunay_collinear(const double *a, const double *b, const double *c);
/* DELAUNAY_OK, or DELAUNAY_ERROR_BROKEN_ARITHMETIC under flags or FPU modes that break exactness. */
DELAUNAY_API delaunay_result delaunay_selftest(void);

/* -- mesh object */

/* Room for so many vertices and tetrahedra (totals, ghost and dummy counted); may move the arrays. */
DELAUNAY_API delaunay_result delaunay_reserve(delaunay_mesh *mesh, size_t vertices, size_t tets);
/* Allocates flags and color (zeros). */
DELAUNAY_API delaunay_result delaunay_enable_marks(delaunay_mesh *mesh);
/* Allocates vertex_tet and fills it. Kept up to date by delaunay_replace from then on. */
DELAUNAY_API delaunay_result delaunay_link_vertices(delaunay_mesh *mesh);
/* Appends a vertex with the given id; returns its index, 0 when out of memory. Not yet in any tetrahedron. */
DELAUNAY_API uint32_t delaunay_add_vertex(delaunay_mesh *mesh, const double *xyz, uint32_t id);
/* A mesh from arrays of anybody's: tets are 4 indices into xyz each, positive by our convention or all
 * negative (then turned); facets with one tetrahedron get handle 0. colors may be NULL. */
DELAUNAY_API delaunay_result delaunay_import(delaunay_mesh *mesh, const double *xyz, size_t num_points,
                                             const uint32_t *tets, const uint32_t *colors, size_t num_tets,
                                             const delaunay_host *host, delaunay_report *report);
/* Removes deleted slots and puts vertices of tetrahedra and the slots in canonical order: a function of the
 * triangulation and the vertex numbers alone (DECISIONS: same bytes for any number of threads). */
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
static const uint8_t delaunay_edge_vertices[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
static const uint8_t delaunay_edge_of[4][4] = {{9, 0, 1, 2}, {0, 9, 3, 4}, {1, 3, 9, 5}, {2, 4, 5, 9}};
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
DELAUNAY_API delaunay_worker *delaunay_worker_new(delaunay_memory *memory); /* NULL: out of memory */
DELAUNAY_API void delaunay_worker_free(delaunay_worker *worker);

/* A list of tetrahedra that grows in a worker's or a caller's hands. Zero to start. */
typedef struct delaunay_list {
    delaunay_handle *items;
    size_t           count, cap;
    delaunay_memory *memory;
} delaunay_list;
DELAUNAY_API delaunay_result delaunay_list_push(delaunay_list *list, delaunay_handle item);
DELAUNAY_API void delaunay_list_free(delaunay_list *list);

/* -- stars and searches; need vertex_tet. out is emptied first. Only tetrahedra connected through facets
 *    that contain the vertex or edge are found: all, in a valid mesh whose star is not cut by NONE handles. */
DELAUNAY_API delaunay_result delaunay_vertex_star(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                  uint32_t v, delaunay_list *out);
/* t contains a and b. In the order of turning around the edge where it closes. */
DELAUNAY_API delaunay_result delaunay_edge_star(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                delaunay_handle t, uint32_t a, uint32_t b, delaunay_list *out);
/* A tetrahedron that contains the edge, or 0. */
DELAUNAY_API delaunay_handle delaunay_find_edge(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                uint32_t a, uint32_t b);
/* The facet handle 4*t+i with these vertices, one of its two sides, or 0. */
DELAUNAY_API delaunay_handle delaunay_find_facet(const delaunay_mesh *mesh, delaunay_worker *worker,
                                                 uint32_t a, uint32_t b, uint32_t c);
/* A tetrahedron that contains the point (closed), a ghost that sees it, or 0 where the mesh has no more
 * neighbour. Exact visibility walk with a step bound, then a scan. hint may be 0. */
DELAUNAY_API delaunay_handle delaunay_locate(const delaunay_mesh *mesh, delaunay_worker *worker,
                                             const double *xyz, delaunay_handle hint);

/* -- editing. The one primitive of recovery, refinement and improvement. */

/* Replaces connected tetrahedra by others that fill the same polyhedron.
 *
 *   old      num_old distinct tetrahedra, none deleted
 *   vertices 4 a new tetrahedron, positive (the ghost, if any, last); not checked beyond closure
 *   slots    out, num_new entries, may be NULL: where they are now (old slots first, in order)
 *
 * Links the new ones to each other and to what surrounds them; constrained facets and edges of the old
 * tetrahedra stay marked on the new ones wherever the same triple or pair of vertices is still there; colours:
 * that of old[0]. Sets vertex_tet of every vertex of a new tetrahedron.
 * Returns DELAUNAY_ERROR_INTERNAL, with the mesh untouched, if the new facets do not close the polyhedron;
 * _OUT_OF_MEMORY, untouched.
 */
DELAUNAY_API delaunay_result delaunay_replace(delaunay_mesh *mesh, delaunay_worker *worker,
                                              const delaunay_handle *old_tets, size_t num_old,
                                              const uint32_t *vertices, size_t num_new,
                                              delaunay_handle *slots);
/* Marks (or unmarks) facet f and its other side. */
DELAUNAY_API void delaunay_mark_facet(delaunay_mesh *mesh, delaunay_handle f, int constrained);
/* Marks (or unmarks) an edge in all tetrahedra around it; t contains it. */
DELAUNAY_API delaunay_result delaunay_mark_edge(delaunay_mesh *mesh, delaunay_worker *worker,
                                                delaunay_handle t, uint32_t a, uint32_t b, int constrained);

/* -- closure search: the best triangulation of one small polyhedron [Marot 2020, 6.2].
 * Recovery asks for fewer crossings of a missing edge or facet, improvement for the best worst quality. */
enum {
    DELAUNAY_WINDOW_VERTICES = 32,
    DELAUNAY_WINDOW_TETS     = 400, /* old or new tetrahedra of a window at most */
    DELAUNAY_WINDOW_FACETS   = 512,
    DELAUNAY_WINDOW_KEPT     = 64
};

/* A connected set of tetrahedra, none of them a ghost, and the polyhedron that is their union. */
typedef struct delaunay_window {
    uint32_t        num_tets, num_vertices, num_facets, num_kept_edges, num_kept_facets;
    delaunay_handle tets[DELAUNAY_WINDOW_TETS];
    uint32_t        vertices[DELAUNAY_WINDOW_VERTICES];     /* mesh vertices; below: indices into this */
    uint8_t         facets[DELAUNAY_WINDOW_FACETS][3];      /* boundary, outward order */
    uint8_t         kept_edges[DELAUNAY_WINDOW_KEPT][2];    /* constrained, interior: must stay */
    uint8_t         kept_facets[DELAUNAY_WINDOW_KEPT][3];   /* constrained, interior: must stay */
    uint32_t        interior;                               /* bit mask: vertices not on the boundary */
    uint32_t        dropped;                                /* bit mask, set by the caller: interior vertices to leave out */
} delaunay_window;

/* Fills a window. keep_facets, keep_edges: list what is constrained inside (else it may vanish).
 * Returns 1; 0 if it has a ghost, more than max_vertices (at most 32) or too much of anything. */
DELAUNAY_API int delaunay_window_set(delaunay_window *window, const delaunay_mesh *mesh, delaunay_worker *worker,
                                     const delaunay_handle *tets, size_t num_tets, uint32_t max_vertices,
                                     int keep_edges, int keep_facets);

typedef enum delaunay_objective {
    DELAUNAY_ANY,             /* any triangulation */
    DELAUNAY_BEST_QUALITY,    /* maximise the worst quality, above bound */
    DELAUNAY_FEWER_FACES,     /* fewer interior faces crossed by the segment target[0] target[1] than bound */
    DELAUNAY_FEWER_EDGES      /* fewer interior edges that pierce the triangle target[0..2] than bound */
} delaunay_objective;

typedef struct delaunay_search {
    delaunay_objective objective;
    /* BEST_QUALITY: larger is better, any order of the four points gives the same bits; 0 or less: unacceptable */
    double (*quality)(void *user, const double *a, const double *b, const double *c, const double *d);
    void    *user;
    double   bound;       /* a result must be strictly better: above (quality), below (crossings) */
    uint32_t target[3];   /* mesh vertices */
    uint32_t max_nodes;   /* of the search tree; 0: 100000 */
    /* out */
    int      proven;      /* 1: the search was exhausted: what was found is the best, or nothing exists */
    uint32_t nodes;
    double   value;       /* worst quality, or number of crossings, of the result */
    uint32_t num_tets;
    uint8_t  tets[DELAUNAY_WINDOW_TETS][4]; /* of the result: local vertices, positive */
} delaunay_search;

/* Searches a triangulation of the window with the objective. Returns 1 if found, 0 if not (proven says
 * whether there is none, or the limit was met). Crossing objectives stop at the first strict decrease.
 * Exact orientations only; no intersection tests are needed (proof in >>reconnect). Thread-safe. */
DELAUNAY_API int delaunay_reconnect(const delaunay_mesh *mesh, delaunay_worker *worker,
                                    const delaunay_window *window, delaunay_search *search);
/* Puts the result of a search in place of the window's tetrahedra: delaunay_replace. slots may be NULL. */
DELAUNAY_API delaunay_result delaunay_window_apply(delaunay_mesh *mesh, delaunay_worker *worker,
                                                   const delaunay_window *window, const delaunay_search *search,
                                                   delaunay_handle *slots);
/* Crossings of the window's present triangulation, for crossing objectives: the bound to start from. */
DELAUNAY_API uint32_t delaunay_window_crossings(const delaunay_mesh *mesh, const delaunay_window *window,
                                                delaunay_objective objective, const uint32_t *target);
/* The crossing tests themselves, by vertices of the mesh, exact. Open segment ab against closed triangle pqr, no
 * vertex shared, a and b strictly on opposite sides; *zeros (may be NULL) gets bits for edges pq, qr, rp met exactly. */
DELAUNAY_API int delaunay_segment_crosses(const delaunay_mesh *mesh, uint32_t a, uint32_t b, uint32_t p,
                                          uint32_t q, uint32_t r, int *zeros);

#ifdef __cplusplus
}
#endif
#endif /* DELAUNAY_H */

/* ============================================================================================
 * Readers of the interface can stop here.
 * ============================================================================================ */
#if defined(DELAUNAY_IMPLEMENTATION) && !defined(DELAUNAY_IMPLEMENTATION_DONE)
#define DELAUNAY_IMPLEMENTATION_DONE
#include <math.h>
#include <stdio.h> /* snprintf only */
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifdef _OPENMP
#  include <omp.h>
#endif

#if defined(__GNUC__)
#  define DELAUNAY__UNLIKELY(x) __builtin_expect(!!(x), 0)
#  define DELAUNAY__NOINLINE __attribute__((noinline))
#else
#  define DELAUNAY__UNLIKELY(x) (x)
#  define DELAUNAY__NOINLINE
#endif

/* ---- >>memory ----------------------------------------------------------------------------- */

static void *delaunay__malloc(void *user, size_t size) { (void)user; return malloc(size); }
static void delaunay__free(void *user, void *block) { (void)user; free(block); }

/* Ahead of each block: what release must know. Blocks start on 64-byte borders. */
typedef struct delaunay__block {
    void  *base;
    size_t size; /* asked of the allocator */
} delaunay__block;
enum { DELAUNAY__ALIGN = 64 };

DELAUNAY_API delaunay_result delaunay_memory_init(delaunay_memory *memory, const delaunay_host *host)
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

DELAUNAY_API void *delaunay_alloc(delaunay_memory *memory, size_t count, size_t size)
{
    size_t total;
    char *base, *block;
    delaunay__block *head;
    if (size != 0 && count > (SIZE_MAX - 2 * DELAUNAY__ALIGN) / size) return NULL;
    total = count * size + 2 * DELAUNAY__ALIGN;
    if (memory->limit_bytes && (total > memory->limit_bytes || memory->bytes > memory->limit_bytes - total))
        return NULL;
    base = (char *)memory->allocator.alloc(memory->allocator.user, total);
    if (!base) return NULL;
    block = base + (2 * DELAUNAY__ALIGN - (size_t)((uintptr_t)base % DELAUNAY__ALIGN));
    head = (delaunay__block *)(void *)(block - DELAUNAY__ALIGN);
    head->base = base;
    head->size = total;
    memory->bytes += total;
    if (memory->bytes > memory->peak_bytes) memory->peak_bytes = memory->bytes;
    return block;
}

DELAUNAY_API void delaunay_release(delaunay_memory *memory, void *block)
{
    delaunay__block head;
    if (!block) return;
    head = *(delaunay__block *)(void *)((char *)block - DELAUNAY__ALIGN);
    memory->bytes -= head.size;
    memory->allocator.release(memory->allocator.user, head.base);
}

DELAUNAY_API void *delaunay_grow(delaunay_memory *memory, void *old, size_t keep, size_t count, size_t size)
{
    void *block = delaunay_alloc(memory, count, size);
    if (!block) return NULL;
    if (keep && old) memcpy(block, old, keep * size);
    delaunay_release(memory, old);
    return block;
}

DELAUNAY_API double delaunay_seconds(const delaunay_host *host)
{
    if (host && host->clock) return host->clock(host->user);
#ifdef _OPENMP
    return omp_get_wtime();
#else
    return (double)clock() / (double)CLOCKS_PER_SEC;
#endif
}

DELAUNAY_API int delaunay_threads(const delaunay_host *host)
{
#ifdef _OPENMP
    if (host && host->num_threads > 0) return host->num_threads;
    return omp_get_max_threads();
#else
    (void)host;
    return 1;
#endif
}

DELAUNAY_API delaunay_result delaunay_list_push(delaunay_list *list, delaunay_handle item)
{
    if (list->count == list->cap) {
        size_t cap = list->cap ? 2 * list->cap : 64;
        void *items = delaunay_grow(list->memory, list->items, list->count, cap, sizeof *list->items);
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
/* Expansions: sums of doubles that do not overlap, increasing magnitude, no zeros [Shewchuk 1997].
 * Nothing here depends on whether the compiler contracts products into FMAs: two_sum has no product, and the
 * product's error comes from fma() itself or from a splitting whose partial products are exact. */
static void delaunay__two_sum(double a, double b, double *s, double *t)
{
    double x = a + b, bb = x - a;
    *t = (a - (x - bb)) + (b - bb);
    *s = x;
}

static double delaunay__product_error(double a, double b, double p)
{
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    return fma(a, b, -p);
#else
    double ca = 134217729.0 * a, cb = 134217729.0 * b;
    double ah = ca - (ca - a), al = a - ah, bh = cb - (cb - b), bl = b - bh;
    double e = ah * bh - p;
    e = e + ah * bl;
    e = e + al * bh;
    return e + al * bl;
#endif
}

/* h = e + f */
static int delaunay__expansion_add(const double *e, int m, const double *f, int n, double *h)
{
    int i = 0, j = 0, k = 0;
    double q = 0, r, g;
    while (i < m || j < n) {
        g = j >= n || (i < m && fabs(e[i]) < fabs(f[j])) ? e[i++] : f[j++];
        delaunay__two_sum(q, g, &q, &r);
        if (r != 0) h[k++] = r;
    }
    if (q != 0) h[k++] = q;
    return k;
}

/* h = e * b */
static int delaunay__expansion_scale(const double *e, int m, double b, double *h)
{
    int i, k = 0;
    double q, r, p, t, s;
    if (m == 0 || b == 0) return 0;
    q = e[0] * b;
    r = delaunay__product_error(e[0], b, q);
    if (r != 0) h[k++] = r;
    for (i = 1; i < m; i++) {
        p = e[i] * b;
        t = delaunay__product_error(e[i], b, p);
        delaunay__two_sum(q, t, &s, &r);
        if (r != 0) h[k++] = r;
        delaunay__two_sum(p, s, &q, &r);
        if (r != 0) h[k++] = r;
    }
    if (q != 0) h[k++] = q;
    return k;
}

/* h = e * f; scratch of 2*m + 2*m*n doubles */
static int delaunay__expansion_mul(const double *e, int m, const double *f, int n, double *h, double *scratch)
{
    int j, k = 0, c;
    double *scaled = scratch, *sum = scratch + 2 * m;
    for (j = 0; j < n; j++) {
        c = delaunay__expansion_scale(e, m, f[j], scaled);
        memcpy(sum, h, (size_t)k * sizeof *h);
        k = delaunay__expansion_add(sum, k, scaled, c, h);
    }
    return k;
}

typedef struct delaunay__expansion2 {
    int    n;
    double c[2];
} delaunay__expansion2;

static delaunay__expansion2 delaunay__difference(double a, double b)
{
    delaunay__expansion2 r;
    double s, t;
    delaunay__two_sum(a, -b, &s, &t);
    r.n = 0;
    r.c[0] = r.c[1] = 0;
    if (t != 0) r.c[r.n++] = t;
    if (s != 0) r.c[r.n++] = s;
    return r;
}

static void delaunay__negate(double *h, int n)
{
    int i;
    for (i = 0; i < n; i++) h[i] = -h[i];
}

static int delaunay__expansion_sign(const double *h, int n) { return n == 0 ? 0 : h[n - 1] > 0 ? 1 : -1; }

/* h (16) = the 2x2 determinant of columns j and l of two rows */
static int delaunay__expansion_minor(const delaunay__expansion2 *b, const delaunay__expansion2 *c, int j, int l,
                                     double *h)
{
    double p[8], q[8], scratch[16];
    int np = delaunay__expansion_mul(b[j].c, b[j].n, c[l].c, c[l].n, p, scratch);
    int nq = delaunay__expansion_mul(b[l].c, b[l].n, c[j].c, c[j].n, q, scratch);
    delaunay__negate(q, nq);
    return delaunay__expansion_add(p, np, q, nq, h);
}

/* h (192) = the determinant of three rows of differences */
static int delaunay__expansion_det3(const delaunay__expansion2 *a, const delaunay__expansion2 *b,
                                    const delaunay__expansion2 *c, double *h)
{
    double minor[16], term[64], scratch[128], sum[192];
    int i, n, k = 0;
    for (i = 0; i < 3; i++) {
        n = delaunay__expansion_minor(b, c, (i + 1) % 3, (i + 2) % 3, minor);
        n = delaunay__expansion_mul(minor, n, a[i].c, a[i].n, term, scratch);
        memcpy(sum, h, (size_t)k * sizeof *h);
        k = delaunay__expansion_add(sum, k, term, n, h);
    }
    return k;
}

static void delaunay__row(delaunay__expansion2 *r, const double *p, const double *origin)
{
    int i;
    for (i = 0; i < 3; i++) r[i] = delaunay__difference(p[i], origin[i]);
}

DELAUNAY_API int delaunay_orient3d_exact(const double *a, const double *b, const double *c, const double *d)
{
    delaunay__expansion2 r[3][3];
    double h[192];
    delaunay__row(r[0], b, a);
    delaunay__row(r[1], c, a);
    delaunay__row(r[2], d, a);
    return delaunay__expansion_sign(h, delaunay__expansion_det3(r[0], r[1], r[2], h));
}

/* Filter: |det| beyond 7 eps times the permanent is certain [Shewchuk 1997]; permanent <= 1.16 |b||c||d|. */
DELAUNAY_API int delaunay_orient3d(const double *a, const double *b, const double *c, const double *d)
{
    double bx = b[0] - a[0], by = b[1] - a[1], bz = b[2] - a[2];
    double cx = c[0] - a[0], cy = c[1] - a[1], cz = c[2] - a[2];
    double dx = d[0] - a[0], dy = d[1] - a[1], dz = d[2] - a[2];
    double det = bx * (cy * dz - cz * dy) + by * (cz * dx - cx * dz) + bz * (cx * dy - cy * dx);
    double lb = bx * bx + by * by + bz * bz, lc = cx * cx + cy * cy + cz * cz;
    double ld = dx * dx + dy * dy + dz * dz;
    if (det * det > 2e-30 * lb * lc * ld + 1e-290) return det > 0 ? 1 : -1;
    return delaunay_orient3d_exact(a, b, c, d);
}

static DELAUNAY__NOINLINE int delaunay__insphere_exact(const double *a, const double *b, const double *c,
                                                       const double *d, const double *e)
{
    delaunay__expansion2 r[4][3];
    const double *q[4];
    double total[4 * 9216], sum[3 * 9216], term[9216], scratch[9216 + 384];
    int i, j, k = 0;
    q[0] = a; q[1] = b; q[2] = c; q[3] = d;
    for (i = 0; i < 4; i++) delaunay__row(r[i], q[i], e);
    for (i = 0; i < 4; i++) {
        double lift[24], part[24], square[8], minor[192];
        int nl = 0, ns, nm, nt;
        for (j = 0; j < 3; j++) {
            ns = delaunay__expansion_mul(r[i][j].c, r[i][j].n, r[i][j].c, r[i][j].n, square, scratch);
            memcpy(part, lift, (size_t)nl * sizeof *lift);
            nl = delaunay__expansion_add(part, nl, square, ns, lift);
        }
        nm = delaunay__expansion_det3(r[(i + 1) & 3], r[(i + 2) & 3], r[(i + 3) & 3], minor);
        if (i & 1) delaunay__negate(minor, nm);
        nt = delaunay__expansion_mul(minor, nm, lift, nl, term, scratch);
        memcpy(sum, total, (size_t)k * sizeof *total);
        k = delaunay__expansion_add(sum, k, term, nt, total);
    }
    return delaunay__expansion_sign(total, k);
}

DELAUNAY_API int delaunay_insphere(const double *a, const double *b, const double *c, const double *d,
                                   const double *e)
{
    double ax = a[0] - e[0], ay = a[1] - e[1], az = a[2] - e[2];
    double bx = b[0] - e[0], by = b[1] - e[1], bz = b[2] - e[2];
    double cx = c[0] - e[0], cy = c[1] - e[1], cz = c[2] - e[2];
    double dx = d[0] - e[0], dy = d[1] - e[1], dz = d[2] - e[2];
    double ab = ax * by - bx * ay, bc = bx * cy - cx * by, cd = cx * dy - dx * cy;
    double da = dx * ay - ax * dy, ac = ax * cy - cx * ay, bd = bx * dy - dx * by;
    double abc = az * bc - bz * ac + cz * ab, bcd = bz * cd - cz * bd + dz * bc;
    double cda = cz * da + dz * ac + az * cd, dab = dz * ab + az * bd + bz * da;
    double al = ax * ax + ay * ay + az * az, bl = bx * bx + by * by + bz * bz;
    double cl = cx * cx + cy * cy + cz * cz, dl = dx * dx + dy * dy + dz * dz;
    double det = (cl * dab - dl * abc) + (al * bcd - bl * cda);
    double l = al > bl ? al : bl;
    l = l > cl ? l : cl;
    l = l > dl ? l : dl;
    if (det * det > 1e-28 * (l * l * l * l * l) + 1e-290) return det > 0 ? 1 : -1;
    return delaunay__insphere_exact(a, b, c, d, e);
}

static int delaunay__lexicographic_less(const double *a, const double *b)
{
    return a[0] != b[0] ? a[0] < b[0] : a[1] != b[1] ? a[1] < b[1] : a[2] < b[2];
}

/* The lifted points are perturbed by infinitesimals that shrink fast in lexicographic order: the first
 * nonzero cofactor of the greatest, then of the second greatest point decides; two steps are enough for
 * distinct points. If that point is e, it is lifted most and lies outside. */
static int delaunay__insphere_tie(const double *a, const double *b, const double *c, const double *d, const double *e)
{
    const double *p[5], *s[4];
    int first = 4, second = -1, i, k, o;
    p[0] = a; p[1] = b; p[2] = c; p[3] = d; p[4] = e;
    for (i = 0; i < 4; i++)
        if (delaunay__lexicographic_less(p[first], p[i])) first = i;
    for (i = 0; i < 5; i++)
        if (i != first && (second < 0 || delaunay__lexicographic_less(p[second], p[i]))) second = i;
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

DELAUNAY_API int delaunay_insphere_perturbed(const double *a, const double *b, const double *c, const double *d,
                                             const double *e)
{
    int s = delaunay_insphere(a, b, c, d, e);
    return s ? s : delaunay__insphere_tie(a, b, c, d, e);
}

DELAUNAY_API int delaunay_collinear(const double *a, const double *b, const double *c)
{
    int i, j;
    for (i = 0; i < 3; i++) {
        delaunay__expansion2 u[3], v[3];
        double h[16];
        j = (i + 1) % 3;
        delaunay__row(u, b, a);
        delaunay__row(v, c, a);
        if (delaunay__expansion_minor(u, v, i, j, h) != 0) return 0;
    }
    return 1;
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
#define DELAUNAY__GROW(type, field, used, cap)                                                     \
    do {                                                                                           \
        type *grown_ = (type *)delaunay_grow(&mesh->memory, mesh->field, (used), (cap), sizeof(type)); \
        if (!grown_) return DELAUNAY_ERROR_OUT_OF_MEMORY;                                          \
        memset((void *)(grown_ + (used)), 0, ((cap) - (used)) * sizeof(type));                     \
        mesh->field = grown_;                                                                      \
    } while (0)

static delaunay_result delaunay__reserve_vertices(delaunay_mesh *mesh, size_t vertices)
{
    size_t used = mesh->num_vertices;
    if (vertices <= mesh->cap_vertices) return DELAUNAY_OK;
    if (vertices >= UINT32_MAX) return DELAUNAY_ERROR_TOO_LARGE;
    DELAUNAY__GROW(delaunay_vertex, vertices, used, vertices);
    DELAUNAY__GROW(uint32_t, vertex_id, used, vertices);
    if (mesh->vertex_tet) DELAUNAY__GROW(delaunay_handle, vertex_tet, used, vertices);
    mesh->cap_vertices = (uint32_t)vertices;
    return DELAUNAY_OK;
}

static delaunay_result delaunay__reserve_tets(delaunay_mesh *mesh, size_t tets)
{
    size_t used = mesh->num_tets;
    if (tets <= mesh->cap_tets) return DELAUNAY_OK;
    if (tets >= (size_t)((delaunay_handle)-1) / 4) return DELAUNAY_ERROR_TOO_LARGE;
    DELAUNAY__GROW(delaunay_tet, tets, used, tets);
    DELAUNAY__GROW(uint8_t, mark, used, tets);
    if (mesh->flags) DELAUNAY__GROW(uint16_t, flags, used, tets);
    if (mesh->color) DELAUNAY__GROW(uint32_t, color, used, tets);
    mesh->cap_tets = (delaunay_handle)tets;
    return DELAUNAY_OK;
}

DELAUNAY_API delaunay_result delaunay_reserve(delaunay_mesh *mesh, size_t vertices, size_t tets)
{
    delaunay_result result = DELAUNAY_OK;
    if (!mesh->memory.allocator.alloc) result = delaunay_memory_init(&mesh->memory, NULL);
    if (result == DELAUNAY_OK) result = delaunay__reserve_vertices(mesh, vertices < 1 ? 1 : vertices);
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
    for (t = mesh->num_tets; t-- > 1;)
        if (!delaunay_is_deleted(mesh, t))
            for (i = 0; i < 4; i++) mesh->vertex_tet[mesh->tets[t].v[i]] = t;
    return DELAUNAY_OK;
}

DELAUNAY_API uint32_t delaunay_add_vertex(delaunay_mesh *mesh, const double *xyz, uint32_t id)
{
    uint32_t v = mesh->num_vertices;
    if (v == mesh->cap_vertices) {
        size_t cap = (size_t)v + v / 2 + 64;
        if (cap >= UINT32_MAX) cap = UINT32_MAX - 1;
        if (delaunay__reserve_vertices(mesh, cap) != DELAUNAY_OK) return 0;
    }
    mesh->num_vertices++;
    memcpy(mesh->vertices[v].x, xyz, 3 * sizeof *xyz);
    mesh->vertices[v].key = mesh->vertices[v].local = 0;
    mesh->vertex_id[v] = id;
    if (mesh->vertex_tet) mesh->vertex_tet[v] = 0;
    return v;
}

DELAUNAY_API uint64_t delaunay_count_tets(const delaunay_mesh *mesh)
{
    uint64_t n = 0;
    delaunay_handle t;
    for (t = 1; t < mesh->num_tets; t++) n += !delaunay_is_deleted(mesh, t) && !delaunay_is_ghost(mesh, t);
    return n;
}

/* ---- >>insertion ----------------------------------------------------------------------- */

/* ---- >>build --------------------------------------------------------------------------- */

/* ---- >>partitions ---------------------------------------------------------------------- */

/* ---- >>editing ------------------------------------------------------------------------- */

/* ---- >>reconnect ----------------------------------------------------------------------- */

/* ---- >>speculate ----------------------------------------------------------------------- */

/* ---- >>validate ------------------------------------------------------------------------ */

/* ---- >>public ----------------------------------------------------------------------------- */

DELAUNAY_API const char *delaunay_result_string(delaunay_result result)
{
    switch (result) {
    case DELAUNAY_OK: return "success";
    case DELAUNAY_STOPPED_BY_BUDGET: return "stopped by a budget; the mesh is valid";
    case DELAUNAY_GOAL_NOT_MET: return "a goal was not met; the mesh is valid";
    case DELAUNAY_ERROR_INVALID_ARGUMENT: return "invalid argument";
    case DELAUNAY_ERROR_OUT_OF_MEMORY: return "out of memory";
    case DELAUNAY_CANCELLED: return "cancelled by the caller";
    case DELAUNAY_ERROR_TOO_LARGE: return "too many points or tetrahedra for the index type";
    case DELAUNAY_ERROR_INTERNAL: return "internal error";
    case DELAUNAY_ERROR_DIMENSION: return "the points do not span three dimensions";
    case DELAUNAY_ERROR_NOT_FINITE: return "a coordinate is not finite";
    case DELAUNAY_ERROR_RANGE: return "the coordinates span too many orders of magnitude";
    case DELAUNAY_ERROR_INVALID_MESH: return "the mesh is not valid";
    case DELAUNAY_ERROR_BROKEN_ARITHMETIC: return "floating-point arithmetic does not follow IEEE 754";
    }
    return "unknown delaunay_result";
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
