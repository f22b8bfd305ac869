/* mesher.h - v0.1.0 - from a triangulated surface to a conforming tetrahedral mesh; the surface comes back bit for bit
 *
 *     #define MESHER_IMPLEMENTATION       // in one file of your program
 *     #include "mesher.h"                 // needs delaunay.h, hilbert.h and hxtsort.h beside it
 *
 *     mesher_surface surface = {0};       // the caller's arrays; not copied, not written
 *     mesher_domain  domain = {0};
 *     mesher_report  report = {0};
 *     surface.xyz = xyz;             surface.num_vertices = nv;
 *     surface.triangles = triangles; surface.num_triangles = nt;
 *     if (mesher_mesh(&domain, &surface, NULL, &report) >= 0) {
 *         mesher_output out = {0};
 *         if (mesher_export(&domain, &out) == MESHER_OK) use(out.xyz, out.tets, out.regions);
 *         mesher_output_free(&domain, &out);
 *     } else puts(report.message);
 *     mesher_domain_free(&domain);
 *
 *     cc -O3 -fopenmp program.c -o program -lm      (also without -fopenmp: one thread)
 *
 * CONTENTS (search for the tag)
 *   >>dependencies    how this file finds delaunay.h
 *   >>types           status codes, surface, options, findings, report, the domain
 *   >>everyday        check, mesh, export
 *   >>expert          the stages by themselves
 *   >>surface         cheap checks; unique facets and edges
 *   >>check           every defect of a surface, with ids and coordinates
 *   >>empty           Delaunay of the vertices within a box       [Marot 2020, 5]
 *   >>recover         every edge and facet of the input
 *   >>regions         cells coloured by flood fill; policies
 *   >>size            what edge length is wanted where             [Marot 2020, 7]
 *   >>refine          points placed, filtered, inserted            [Marot 2020, 5]
 *   >>public          the everyday functions
 *
 * LICENCE: MIT or public domain, at the end of the file.
 */

/* ---- >>dependencies (outside the guard: a second include may ask for bodies) -------------- */
#if defined(MESHER_IMPLEMENTATION) && !defined(MESHER_NO_DEPENDENCIES) && !defined(DELAUNAY_IMPLEMENTATION)
#  define DELAUNAY_IMPLEMENTATION
#endif
#if defined(MESHER_STATIC) && !defined(DELAUNAY_H)
#  define DELAUNAY_STATIC
#endif
#include "delaunay.h"
#if DELAUNAY_VERSION < 100
#  error "mesher.h needs delaunay.h 0.1.0 or newer"
#endif

#ifndef MESHER_H
#define MESHER_H
#define MESHER_VERSION 100 /* 10000*major + 100*minor + patch */

#ifndef MESHER_API
#  if !defined(MESHER_STATIC)
#    define MESHER_API extern
#  elif defined(__GNUC__)
#    define MESHER_API static __attribute__((unused))
#  else
#    define MESHER_API static
#  endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- >>types ------------------------------------------------------------------------------ */

/* As delaunay_result; positive: the mesh is valid. */
typedef enum mesher_result {
    MESHER_OK                     = 0,
    MESHER_STOPPED_BY_BUDGET      = 1,
    MESHER_GOAL_NOT_MET           = 2,
    MESHER_ERROR_INVALID_ARGUMENT = -1,
    MESHER_ERROR_OUT_OF_MEMORY    = -2,
    MESHER_CANCELLED              = -3,
    MESHER_ERROR_TOO_LARGE        = -4,
    MESHER_ERROR_INTERNAL         = -5,
    MESHER_ERROR_SURFACE          = -64, /* the surface is invalid: the findings say where */
    MESHER_ERROR_RECOVERY         = -65, /* an edge or facet could not be recovered: findings */
    MESHER_ERROR_TIME             = -66  /* out of time before there was a valid mesh */
} mesher_result;

/* The caller's surface: plain arrays, any orientation, any number of shells and sheets. Zero what is absent. */
typedef struct mesher_surface {
    const double   *xyz;            /* 3*num_vertices */
    size_t          num_vertices;
    const uint32_t *triangles;      /* 3*num_triangles indices into the vertices */
    const int32_t  *triangle_tags;  /* num_triangles, or NULL: all 1 */
    size_t          num_triangles;
    const uint32_t *edges;          /* 2*num_edges: lines that must be edges of the mesh too */
    const int32_t  *edge_tags;
    size_t          num_edges;
    const double   *seeds;          /* 3*num_seeds: for MESHER_REGIONS_SEEDS, points inside cells to keep ... */
    const int32_t  *seed_tags;      /* ... and their region numbers (> 0; NULL: 1, 2, ..); 0: a hole */
    size_t          num_seeds;
} mesher_surface;

/* Which bounded cells are kept as regions. */
typedef enum mesher_regions {
    MESHER_REGIONS_ALL,     /* every bounded cell is a region of its own */
    MESHER_REGIONS_PARITY,  /* a cell is kept if an odd number of facets lies between it and the outside */
    MESHER_REGIONS_WINDING, /* a cell is kept if its winding number by the facets' orientation is not 0 */
    MESHER_REGIONS_SEEDS    /* cells that contain a seed with a tag > 0; if no such seed is given, all but holes */
} mesher_regions;

typedef struct mesher_options {
    delaunay_host  host;
    mesher_regions regions;
    int    no_refine;             /* the surface recovered, and nothing else */
    int    allow_surface_steiner; /* at the very last, points on edges and facets of the surface; counted, listed */
    int    no_intersection_test;  /* mesher_check: only the cheap checks */
    double size;                  /* wanted edge length, at most; 0: from the surface alone */
    double min_size, max_size;    /* bounds of the size field; 0: none */
    double gradation;             /* largest ratio of sizes one edge apart; 0: 1.4 */
    double growth;                /* > 1: sizes grow inwards by this ratio, instead of interpolating the surface's */
    /* Size field in batches, thread-safe: out[i] = wanted length at xyz+3*i; <= 0 or NaN: no wish. May be NULL.
     * Combined with the others by the minimum. */
    void (*size_function)(void *user, size_t count, const double *xyz, const uint32_t *region, double *out);
    void  *size_user;
    uint64_t max_vertices, max_tets; double max_seconds; /* budgets of refinement; 0: none */
} mesher_options;

/* Defects make a surface invalid; notes do not. */
typedef enum mesher_kind {
    MESHER_NOTE_DUPLICATE_VERTEX, MESHER_NOTE_UNUSED_VERTEX, MESHER_NOTE_REPEATED_INDEX,
    MESHER_NOTE_DUPLICATE_TRIANGLE, MESHER_NOTE_OPPOSITE_TRIANGLE, MESHER_NOTE_FLIPPED_TRIANGLE,
    MESHER_NOTE_OPEN_EDGE, MESHER_NOTE_NON_MANIFOLD_EDGE, MESHER_NOTE_SHEET, MESHER_NOTE_SHELL_FILLED,
    MESHER_NOTE_SURFACE_STEINER,
    MESHER_DEFECT_FIRST,
    MESHER_DEFECT_NOT_FINITE = MESHER_DEFECT_FIRST, MESHER_DEFECT_RANGE, MESHER_DEFECT_INDEX,
    MESHER_DEFECT_COLLINEAR, MESHER_DEFECT_T_JUNCTION, MESHER_DEFECT_OVERLAP, MESHER_DEFECT_INTERSECTION,
    MESHER_DEFECT_FLAT, MESHER_DEFECT_NO_CELL, MESHER_DEFECT_OUTSIDE_FACET, MESHER_DEFECT_RECOVERY,
    MESHER_NUM_KINDS
} mesher_kind;

/* One finding: what, which of the caller's triangles and vertices, where. Unused ids: DELAUNAY_NO_ID.
 * A line of the caller's counts as triangle num_triangles + line, here and in edge_source. */
typedef struct mesher_finding {
    mesher_kind kind;
    uint32_t    triangles[2];
    uint32_t    vertices[3];
    double      xyz[3];
} mesher_finding;

typedef struct mesher_report {
    /* in: room for findings, the caller's; the first ones are kept, all are counted */
    mesher_finding *findings;
    size_t          cap_findings;
    /* out */
    size_t   num_findings;                   /* written to findings */
    uint64_t counts[MESHER_NUM_KINDS];       /* of each kind, all of them */
    uint64_t num_vertices, num_tets, num_regions, num_boundary_edges;
    uint64_t missing_edges, missing_facets;  /* of the input in the empty mesh */
    uint64_t interior_steiner, surface_steiner;
    uint64_t refined_vertices, refinement_sweeps;
    double   seconds_check, seconds_empty, seconds_recover, seconds_regions, seconds_size, seconds_refine;
    double   size_p10, size_p50, size_p90, size_in_band; /* edge length / wanted; share within [0.7, 1.4] */
    size_t   peak_bytes;
    char     message[512];                   /* a sentence that says what and where; empty on success */
} mesher_report;

typedef struct mesher_region {
    uint32_t number;        /* colour of its tetrahedra, 1 .. */
    uint32_t first_facet;   /* smallest triangle of the caller's on its boundary */
    uint32_t depth;         /* facets between it and the outside, at least */
    int      winding;
    int      kept;
    uint64_t num_tets;
    double   volume;
} mesher_region;

/* What an input vertex is for. */
enum {
    MESHER_VERTEX_ABSENT,   /* a duplicate of another, or isolated and exactly on a facet or line */
    MESHER_VERTEX_SURFACE,  /* in a facet or line */
    MESHER_VERTEX_ISOLATED  /* in neither: an embedded point of the mesh */
};

/* A domain: the mesh with its constraints, passed from stage to stage. Zero-initialise. Read freely. */
typedef struct mesher_domain {
    mesher_surface  surface;      /* the caller's; must stay alive */
    mesher_options  options;      /* resolved */
    delaunay_mesh   mesh;         /* point i of the surface is mesh.vertex_of[i]; the 8 box corners follow it */
    uint32_t       *facets;       /* 3*num_facets: distinct facets as input point ids, sorted within */
    uint32_t       *facet_source; /* smallest triangle of the caller's with these vertices */
    uint32_t        num_facets;
    uint32_t       *edges;        /* 2*num_edges: distinct edges of facets and lines, input point ids, sorted */
    uint32_t       *edge_source;  /* a triangle that has it, or num_triangles + line */
    uint32_t        num_edges;
    uint32_t       *survivor;     /* input vertex -> first input vertex with the same coordinates */
    uint8_t        *vertex_used;  /* input vertex -> MESHER_VERTEX_..; what is not 0 goes into the triangulation */
    double         *size;         /* wanted edge length at each mesh vertex; NULL before mesher_size */
    uint32_t        cap_size;
    mesher_region  *regions;      /* every bounded cell */
    uint32_t        num_regions;
    uint32_t        first_corner; /* input id of box corner 0: the number of input vertices */
    int             stage;
    delaunay_memory memory;       /* account of the arrays above; the mesh has its own */
} mesher_domain;

/* Plain arrays for the caller: all input vertices first, in input order (duplicates and unused ones stay as
 * orphans); then new vertices in canonical order. */
typedef struct mesher_output {
    double   *xyz;       uint64_t num_vertices;
    uint32_t *tets;      uint64_t num_tets;      /* 4*num_tets; positive as in delaunay.h */
    uint32_t *regions;                           /* num_tets */
} mesher_output;

/* ---- >>everyday --------------------------------------------------------------------------- */

DELAUNAY_INLINE int mesher_is_defect(mesher_kind kind) { return kind >= MESHER_DEFECT_FIRST; }
MESHER_API const char *mesher_result_string(mesher_result result);
MESHER_API const char *mesher_kind_string(mesher_kind kind);

/* All defects and notes of a surface, with ids and coordinates, exact. MESHER_OK if there is no defect. */
MESHER_API mesher_result mesher_check(const mesher_surface *surface, const mesher_options *options,
                                      mesher_report *report);
/* All stages. On failure the domain is freed and zeroed, and the report says what and where. */
MESHER_API mesher_result mesher_mesh(mesher_domain *domain, const mesher_surface *surface,
                                     const mesher_options *options, mesher_report *report);
MESHER_API mesher_result mesher_export(mesher_domain *domain, mesher_output *out);
MESHER_API void mesher_output_free(mesher_domain *domain, mesher_output *out);
MESHER_API void mesher_domain_free(mesher_domain *domain);
/* Defaults filled in; MESHER_ERROR_INVALID_ARGUMENT for nonsense. in may be NULL. */
MESHER_API mesher_result mesher_options_resolve(mesher_options *out, const mesher_options *in);

/* ---- >>expert: the stages, in order; each takes the domain valid and leaves it so ---------- */

/* Cheap checks, survivors of duplicate vertices, distinct facets and edges. */
MESHER_API mesher_result mesher_domain_init(mesher_domain *domain, const mesher_surface *surface,
                                            const mesher_options *options, mesher_report *report);
/* The Delaunay triangulation of the vertices and of the corners of a box around them. */
MESHER_API mesher_result mesher_empty_mesh(mesher_domain *domain, mesher_report *report);
/* Every edge and facet of the domain becomes one of the mesh, and is marked constrained on all its tetrahedra. */
MESHER_API mesher_result mesher_recover(mesher_domain *domain, mesher_report *report);
/* Colours every cell; DELAUNAY_OUTSIDE is what is not kept. Fills regions. */
MESHER_API mesher_result mesher_color(mesher_domain *domain, mesher_report *report);
/* Wanted edge lengths at the vertices. */
MESHER_API mesher_result mesher_size(mesher_domain *domain, mesher_report *report);
/* Points inserted until edges have the wanted length. */
MESHER_API mesher_result mesher_refine(mesher_domain *domain, mesher_report *report);
/* Adds a finding to a report (which may be NULL). */
MESHER_API void mesher_report_add(mesher_report *report, mesher_kind kind, uint32_t triangle0, uint32_t triangle1,
                                  uint32_t vertex0, uint32_t vertex1, uint32_t vertex2, const double *xyz);

#ifdef __cplusplus
}
#endif
#endif /* MESHER_H */

/* ============================================================================================
 * Readers of the interface can stop here.
 * ============================================================================================ */
#if defined(MESHER_IMPLEMENTATION) && !defined(MESHER_IMPLEMENTATION_DONE)
#define MESHER_IMPLEMENTATION_DONE
#include <math.h>
#include <stdio.h> /* snprintf only */
#include <string.h>

/* ---- >>surface ---------------------------------------------------------------------------- */

/* ---- >>check ------------------------------------------------------------------------------ */

/* ---- >>empty ------------------------------------------------------------------------------ */

/* ---- >>recover ---------------------------------------------------------------------------- */

/* ---- >>regions ---------------------------------------------------------------------------- */

/* ---- >>size ------------------------------------------------------------------------------- */

/* ---- >>refine ----------------------------------------------------------------------------- */

/* ---- >>public ----------------------------------------------------------------------------- */

#endif /* MESHER_IMPLEMENTATION */

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
