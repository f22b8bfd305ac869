/* The whole way from a surface to an improved mesh in arrays, with handles of 64 bits. */
#define DELAUNAY_INDEX64
#define MESHER_IMPLEMENTATION
#include "mesher.h"
#define SPR_IMPLEMENTATION
#include "spr.h"
#define MESHIO_IMPLEMENTATION
#include "examples/meshio.h"
#include "examples/demo_part.h"
#include "check.h"

typedef char handles_have_64_bits[sizeof(delaunay_handle) == 8 ? 1 : -1];

/* Meshes the part and improves it; its arrays are to be the same for any number of threads. */
static void mesh_part(const meshio_mesh *part, int threads, mesher_output *out)
{
    mesher_surface surface;
    mesher_options options;
    mesher_domain domain;
    mesher_report report;
    spr_options improve;
    spr_report improved;
    memset(&surface, 0, sizeof surface);
    memset(&options, 0, sizeof options);
    memset(&report, 0, sizeof report);
    memset(&improve, 0, sizeof improve);
    memset(out, 0, sizeof *out);
    surface.xyz = part->xyz;
    surface.num_vertices = part->num_vertices;
    surface.triangles = part->triangles;
    surface.triangle_tags = part->triangle_tags;
    surface.num_triangles = part->num_triangles;
    options.host.num_threads = improve.host.num_threads = threads;
    CHECK(mesher_mesh(&domain, &surface, &options, &report) == MESHER_OK);
    CHECK(report.refined_vertices > 1000 && domain.num_regions == 1);
    CHECK(spr_improve(&domain.mesh, &improve, &improved) == SPR_OK);
    CHECK(improved.after.num_below <= improved.before.num_below && improved.after.min > 0.2);
    CHECK(delaunay_validate(&domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    CHECK(mesher_export(&domain, out) == MESHER_OK);
    CHECK(out->num_triangles == part->num_triangles && out->num_vertices > part->num_vertices);
    CHECK(memcmp(out->xyz, part->xyz, 3 * part->num_vertices * sizeof *out->xyz) == 0);
    mesher_domain_free(&domain);
}

int main(void)
{
    meshio_mesh part;
    mesher_output one, two;
    CHECK(demo_part_make(&part, 1));
    mesh_part(&part, 1, &one);
    mesh_part(&part, 2, &two);
    CHECK(one.num_tets > 10000 && one.num_tets == two.num_tets);
    if (one.num_tets == two.num_tets)
        CHECK(memcmp(one.tets, two.tets, 4 * one.num_tets * sizeof *one.tets) == 0);
    mesher_output_free(NULL, &one);
    mesher_output_free(NULL, &two);
    meshio_free(&part);
    return check_report();
}
