/* The tests of test_delaunay.c with keys of three bits for the canonical order of tetrahedra: there
 * are nearly always equal keys, so that the vertices decide. */
#define DELAUNAY__SHORT_KEY_MASK 0x80000003u
#include "test_delaunay.c"
