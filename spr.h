/* spr.h - v0.1.0 - improves tetrahedral meshes: Small Polyhedron Reconnection, Growing SPR Cavity, smoothing
 *
 *     #define SPR_IMPLEMENTATION          // in one file of your program
 *     #include "spr.h"                    // needs delaunay.h, hilbert.h and hxtsort.h beside it
 *
 *     spr_report report;
 *     spr_improve(&mesh, NULL, &report);  // a delaunay_mesh, of mesher.h or imported
 *     spr_improve_arrays(xyz, nv, tets, nt, ...) works on anybody's arrays
 *
 * CONTENTS (search for the tag)
 *   >>dependencies    how this file finds delaunay.h
 *   >>types           status codes, options, report
 *   >>everyday        improve, measure
 *   >>expert          the operators by themselves
 *   >>quality         gamma, SICN, dihedral angles; bounds set by the surface
 *   >>smoothing       Laplacian with golden section               [Marot 2020, 6.1]
 *   >>edge removal                                                [Marot 2020, 6.1]
 *   >>reconnection    SPR of a grown cavity                       [Marot 2020, 6.2, 6.3]
 *   >>schedule        which operator when                         [Marot 2020, Algorithm 5]
 *   >>public          the everyday functions
 *
 * LICENCE: MIT or public domain, at the end of the file.
 */

/* ---- >>dependencies (outside the guard: a second include may ask for bodies) -------------- */
#if defined(SPR_IMPLEMENTATION) && !defined(SPR_NO_DEPENDENCIES) && !defined(DELAUNAY_IMPLEMENTATION)
#  define DELAUNAY_IMPLEMENTATION
#endif
#if defined(SPR_STATIC) && !defined(DELAUNAY_H)
#  define DELAUNAY_STATIC
#endif
#include "delaunay.h"
#if DELAUNAY_VERSION < 100
#  error "spr.h needs delaunay.h 0.1.0 or newer"
#endif

#ifndef SPR_H
#define SPR_H
#define SPR_VERSION 100 /* 10000*major + 100*minor + patch */

#ifndef SPR_API
#  if !defined(SPR_STATIC)
#    define SPR_API extern
#  elif defined(__GNUC__)
#    define SPR_API static __attribute__((unused))
#  else
#    define SPR_API static
#  endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- >>types ------------------------------------------------------------------------------ */

/* As delaunay_result; positive: the mesh is valid. */
typedef enum spr_result {
    SPR_OK                     = 0,
    SPR_STOPPED_BY_BUDGET      = 1,
    SPR_GOAL_NOT_MET           = 2, /* a target that the caller asked for was not reached everywhere */
    SPR_ERROR_INVALID_ARGUMENT = -1,
    SPR_ERROR_OUT_OF_MEMORY    = -2,
    SPR_CANCELLED              = -3, /* the mesh is valid, improved so far */
    SPR_ERROR_TOO_LARGE        = -4,
    SPR_ERROR_INTERNAL         = -5,
    SPR_ERROR_INVALID_MESH     = -80 /* an imported mesh is not valid: report->message */
} spr_result;

typedef enum spr_measure {
    SPR_GAMMA,        /* sqrt(24) * inradius / longest edge: 1 for the regular one */
    SPR_SICN,         /* signed inverse condition number */
    SPR_MIN_DIHEDRAL, /* smallest sine of the six dihedral angles: dislikes small and large ones alike */
    SPR_USER          /* options.quality */
} spr_measure;

/* Zeros are the recommended setting. */
typedef struct spr_options {
    delaunay_host host;
    spr_measure   measure;
    double        target;      /* tetrahedra below are bad; 0: 0.35 */
    double        max_seconds; /* 0: none */
    int           max_rounds;  /* sweeps over the work list; 0: until nothing changes */
    int           no_smoothing, no_edge_removal, no_reconnection;
    int           keep_vertices;         /* no vertex is added or taken away; they may move */
    int           free_vertices;         /* vertices with an id, the caller's own points, may move and go too;
                                          * by default only those that mesher.h or this header added may */
    int           allow_surface_changes; /* flips of coplanar pairs of facets; off */
    int           require_target;        /* return SPR_GOAL_NOT_MET when something is left below the target */
    /* Larger is better, at most 1, 0 or less for an inverted one; any order of the four points gives the same
     * value; called from all threads. For SPR_USER. */
    double (*quality)(void *user, const double *a, const double *b, const double *c, const double *d);
    void          *quality_user;
    const uint8_t *fixed_vertices;       /* one a mesh vertex, nonzero: must not move; NULL: none but the constrained */
} spr_options;

typedef struct spr_statistics {
    uint64_t num_tets, num_below;      /* below the target */
    double   min, p001, p01, mean;     /* of the measure: minimum, 0.1 % and 1 % quantiles, mean */
    double   sicn_min, gamma_min, dihedral_min_degrees, dihedral_max_degrees;
    uint64_t histogram[20];            /* of the measure, twenty equal parts of [0, 1] */
    uint64_t dihedral_histogram[18];   /* all dihedral angles by 10 degrees */
} spr_statistics;

/* Why a bad tetrahedron is left. */
typedef enum spr_reason {
    SPR_BOUNDED, /* the surface itself holds it below the target: a facet, or the angle between two of them */
    SPR_FIXED,   /* all its vertices are fixed */
    SPR_STUCK,   /* every operator was tried around it as it is now */
    SPR_BUDGET   /* not everything was tried: a budget, or cancelled */
} spr_reason;

/* One bad tetrahedron that is left; bound: no tetrahedron on its surface facets can be better. */
typedef struct spr_worst {
    double          quality, bound, xyz[3];
    delaunay_handle tet;
    spr_reason      reason;
} spr_worst;

typedef struct spr_report {
    spr_statistics before, after;
    uint64_t  smoothed, edges_removed, reconnected, vertices_removed, vertices_inserted; /* successful operations */
    uint64_t  rounds, plans, conflicts;
    uint64_t  bounded;          /* bad tetrahedra left that the surface itself holds below the target */
    spr_worst worst[5];
    int       num_worst;
    double    seconds, seconds_smoothing, seconds_edge_removal, seconds_reconnection;
    size_t    peak_bytes;
    char      message[256];
} spr_report;

/* ---- >>everyday --------------------------------------------------------------------------- */

SPR_API const char *spr_result_string(spr_result result);
/* Improves the worst tetrahedra of every coloured region (all real ones if the mesh has no colours). Constrained
 * facets, constrained edges and their vertices, and facets without neighbour or between colours stay.
 * The worst quality never falls and nothing is ever inverted, exactly. */
SPR_API spr_result spr_improve(delaunay_mesh *mesh, const spr_options *options, spr_report *report);
/* Statistics of the real tetrahedra that are not outside. */
SPR_API spr_result spr_measure_mesh(const delaunay_mesh *mesh, const spr_options *options, spr_statistics *out);
/* On plain arrays of anybody's mesh; the boundary and the interfaces between colours stay.
 *
 *   xyz           in/out  3 doubles a vertex, moved in place; room for cap_vertices
 *   num_vertices  in/out  new vertices come after the caller's; one that went stays in the array, unused
 *   cap_vertices  in      equal to *num_vertices: none is added
 *   tets, colors  in/out  4 vertices and (colors may be NULL) a region each; room for cap_tets; either sign
 *                         convention, ours afterwards; colours by tetrahedron, any value
 *   fixed         in      one byte a vertex, nonzero: must not move; may be NULL
 *
 * Returns SPR_ERROR_TOO_LARGE, and the arrays as they were, if the result needs more than cap_tets;
 *         SPR_ERROR_INVALID_MESH with the place in report->message */
SPR_API spr_result spr_improve_arrays(double *xyz, size_t *num_vertices, size_t cap_vertices, uint32_t *tets,
                                      uint32_t *colors, size_t *num_tets, size_t cap_tets, const uint8_t *fixed,
                                      const spr_options *options, spr_report *report);

/* ---- >>expert ----------------------------------------------------------------------------- */

/* Quality of one tetrahedron; gamma and SICN are negative when inverted. */
SPR_API double spr_gamma(const double *a, const double *b, const double *c, const double *d);
SPR_API double spr_sicn(const double *a, const double *b, const double *c, const double *d);
/* Dihedral angles in degrees, in order of the edges of delaunay.h. */
SPR_API void spr_dihedrals(const double *a, const double *b, const double *c, const double *d, double *out6);
/* The best gamma that any tetrahedron on this triangle can have: over all apices. */
SPR_API double spr_gamma_bound(const double *a, const double *b, const double *c);

#ifdef __cplusplus
}
#endif
#endif /* SPR_H */

/* ============================================================================================
 * Readers of the interface can stop here.
 * ============================================================================================ */
#if defined(SPR_IMPLEMENTATION) && !defined(SPR_IMPLEMENTATION_DONE)
#define SPR_IMPLEMENTATION_DONE

#endif /* SPR_IMPLEMENTATION */

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
