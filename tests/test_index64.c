/* The tests of insertion and removal, test_changing.c, with handles of 64 bits. */
#define DELAUNAY_INDEX64
#include "test_changing.c"
typedef char handles_have_64_bits[sizeof(delaunay_handle) == 8 ? 1 : -1];
