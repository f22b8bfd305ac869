/* cube.c - the library in one page: from a surface in arrays to a good mesh in arrays
 *
 *   cc -O3 -fopenmp examples/cube.c -o cube -lm
 *   cube
 */
#define MESHER_IMPLEMENTATION
#include "../mesher.h"
#define SPR_IMPLEMENTATION
#include "../spr.h"

/* A cube: eight corners, and two triangles a side. Each triangle may have either orientation. */
static const double xyz[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0,
                             0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
static const uint32_t triangles[] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                     2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};

int main(void)
{
    mesher_surface surface;
    mesher_options options;
    mesher_report report;
    mesher_domain domain;
    mesher_output out;
    spr_report quality;
    uint64_t t;
    memset(&surface, 0, sizeof surface); /* zeros are the defaults */
    memset(&options, 0, sizeof options);
    memset(&report, 0, sizeof report);
    surface.xyz = xyz;
    surface.num_vertices = sizeof xyz / sizeof *xyz / 3;
    surface.triangles = triangles;
    surface.num_triangles = sizeof triangles / sizeof *triangles / 3;
    options.size = 0.5; /* the length of edges inside */
    if (mesher_mesh(&domain, &surface, &options, &report) < 0) {
        fprintf(stderr, "%s\n", report.message); /* says what is wrong, and where */
        return 1;
    }
    if (spr_improve(&domain.mesh, NULL, &quality) < 0) /* even then the mesh is still valid */
        fprintf(stderr, "%s\n", quality.message);
    if (mesher_export(&domain, &out) != MESHER_OK) {
        mesher_domain_free(&domain);
        return 1;
    }
    for (t = 0; t < out.num_tets; t++)
        printf("%lu %lu %lu %lu in region %lu\n", (unsigned long)out.tets[4 * t],
               (unsigned long)out.tets[4 * t + 1], (unsigned long)out.tets[4 * t + 2],
               (unsigned long)out.tets[4 * t + 3], (unsigned long)out.regions[t]);
    fprintf(stderr, "%lu vertices, the surface's %lu first; %lu tetrahedra, gamma at least %g\n",
            (unsigned long)out.num_vertices, (unsigned long)surface.num_vertices,
            (unsigned long)out.num_tets, quality.after.min);
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
    return 0;
}
