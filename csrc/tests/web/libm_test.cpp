// The browser's sine, cosine and hyperbolic tangent against this C library's.
//
// With the argument `all`, for all 2^32 floats: it takes an hour or so.
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>

#include "check.hpp"
#include "web/libm/double_sine.hpp"
#include "web/libm/error_free.hpp"
#include "web/libm/hyperbolic_tangent.hpp"
#include "web/libm/single_sine.hpp"

int main() { return 0; }
