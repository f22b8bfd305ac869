/* spr.c - times and qualities of improvement
 *
 *     build/bench_spr [-v] [--threads N] [--rounds N] [--target Q] [--effort E]
 *                     [--measure gamma|sicn|dihedral] [--off smooth|edge|spr|vertices].. MESH ..
 *
 * Each MESH is a tetrahedral mesh in any format of meshio.h; its border and interfaces stay. Prints
 * one CSV line before and one after improvement; the seconds are those of spr_improve alone. --off
 * switches an operator off; -v adds counts and the worst tetrahedra. */
#define SPR_IMPLEMENTATION
#include "spr.h"
#define MESHIO_IMPLEMENTATION
#include "meshio.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static void print_line(const char *path, const char *when, const spr_statistics *s, double seconds)
{
    printf("%s,%s,%lu,%lu,%.4g,%.4g,%.4g,%.4f,%.4g,%.2f,%.2f,%.3f\n", name_of(path), when,
           (unsigned long)s->num_tets, (unsigned long)s->num_below, s->gamma_min, s->p001, s->p01,
           s->mean, s->sicn_min, s->dihedral_min_degrees, s->dihedral_max_degrees, seconds);
}

static int run(const char *path, const spr_options *options, int verbose)
{
    static const char *const reason[] = {"bounded", "fixed", "stuck", "budget"};
    meshio_mesh file;
    meshio_report read;
    delaunay_mesh mesh;
    delaunay_report import;
    spr_report report;
    spr_result result;
    int i;
    memset(&mesh, 0, sizeof mesh);
    if (meshio_read(path, MESHIO_FORMAT_AUTO, &file, &read) != MESHIO_OK || file.num_tets == 0) {
        fprintf(stderr, "%s: %s\n", path, read.message);
        return 1;
    }
    for (i = 0; (size_t)i < file.num_tets; i++) file.tet_tags[i]++;
    if (delaunay_import(&mesh, file.xyz, file.num_vertices, file.tets,
                        (const uint32_t *)file.tet_tags, file.num_tets, &options->host,
                        &import) != DELAUNAY_OK) {
        fprintf(stderr, "%s: %s\n", path, import.message);
        meshio_free(&file);
        return 1;
    }
    meshio_free(&file);
    result = spr_improve(&mesh, options, &report);
    if (result < 0) fprintf(stderr, "%s: %s\n", path, spr_result_string(result));
    print_line(path, "before", &report.before, 0);
    print_line(path, "after", &report.after, report.seconds);
    if (verbose) {
        printf("# smoothed %lu edges %lu reconnected %lu removed %lu inserted %lu bounded %lu "
               "fixed %lu stuck %lu rounds %lu plans %lu "
               "conflicts %lu; s %.3f e %.3f r %.3f\n",
               (unsigned long)report.smoothed, (unsigned long)report.edges_removed,
               (unsigned long)report.reconnected, (unsigned long)report.vertices_removed,
               (unsigned long)report.vertices_inserted, (unsigned long)report.bounded,
               (unsigned long)report.fixed, (unsigned long)report.stuck,
               (unsigned long)report.rounds, (unsigned long)report.plans,
               (unsigned long)report.conflicts, report.seconds_smoothing,
               report.seconds_edge_removal, report.seconds_reconnection);
        for (i = 0; i < report.num_worst; i++)
            printf("# %.4f bound %.4f %s at %g %g %g\n", report.worst[i].quality,
                   report.worst[i].bound, reason[report.worst[i].reason], report.worst[i].xyz[0],
                   report.worst[i].xyz[1], report.worst[i].xyz[2]);
    }
    if (delaunay_validate(&mesh, DELAUNAY_VALIDATE_GEOMETRY, &import) != DELAUNAY_OK) {
        fprintf(stderr, "%s: %s\n", path, import.message);
        result = SPR_ERROR_INTERNAL;
    }
    delaunay_mesh_free(&mesh);
    return result < 0;
}

int main(int argc, char **argv)
{
    spr_options options;
    int i, failed = 0, verbose = 0;
    memset(&options, 0, sizeof options);
    options.free_vertices = 1;
    printf("mesh,when,tets,below,gamma_min,p001,p01,mean,sicn_min,dihedral_min,dihedral_max,"
           "seconds\n");
    for (i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "-v")) verbose = 1;
        else if (i + 1 < argc && !strcmp(argv[i], "--threads"))
            options.host.num_threads = atoi(argv[++i]);
        else if (i + 1 < argc && !strcmp(argv[i], "--rounds")) options.max_rounds = atoi(argv[++i]);
        else if (i + 1 < argc && !strcmp(argv[i], "--target")) options.target = atof(argv[++i]);
        else if (i + 1 < argc && !strcmp(argv[i], "--effort")) options.effort = atof(argv[++i]);
        else if (i + 1 < argc && !strcmp(argv[i], "--measure")) {
            i++;
            options.measure = !strcmp(argv[i], "sicn")       ? SPR_SICN
                              : !strcmp(argv[i], "dihedral") ? SPR_MIN_DIHEDRAL
                                                             : SPR_GAMMA;
        } else if (i + 1 < argc && !strcmp(argv[i], "--off")) {
            i++;
            options.no_smoothing |= !strcmp(argv[i], "smooth");
            options.no_edge_removal |= !strcmp(argv[i], "edge");
            options.no_reconnection |= !strcmp(argv[i], "spr");
            options.keep_vertices |= !strcmp(argv[i], "vertices");
        } else failed |= run(argv[i], &options, verbose);
    }
    return failed;
}
