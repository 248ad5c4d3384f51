#include "engine/distance.hpp"

#include <cmath>

#include "tests/check.hpp"
#include "tests/engine/shapes_for_tests.hpp"

namespace {

using namespace touchdown::engine;

float distance_of(const Transform& transform, SimplexCache cache = {}) {
  return distance(distance_proxy(ground()), distance_proxy(unit_square()), transform, cache);
}

TEST("a side that is parallel to the edge is its height above it") {
  CHECK_NEAR(distance_of(at(5.0f, 1.5f)), 1.0, 1e-6);
}

TEST("a corner above the edge is its height above it") {
  CHECK_NEAR(distance_of(at(5.0f, 1.0f + std::sqrt(0.5f), 45.0f)), 1.0, 1e-6);
}

TEST("beyond the end of the edge two vertices are nearest") {
  CHECK_NEAR(distance_of(at(23.5f, 4.5f)), 5.0, 1e-6);  // from (20, 0) to (23, 4)
}

TEST("shapes that overlap have no distance") { CHECK_EQUAL(distance_of(at(5.0f, 0.2f)), 0.0f); }

TEST("the distance below the edge is positive, too") {
  CHECK_NEAR(distance_of(at(5.0f, -2.5f)), 2.0, 1e-6);
}

TEST("a cache of another pose changes the way but not the distance") {
  SimplexCache cache{};
  distance(distance_proxy(ground()), distance_proxy(unit_square()), at(1.0f, 9.0f, 30.0f), cache);
  CHECK(cache.count > 0);
  CHECK_NEAR(distance_of(at(23.5f, 4.5f), cache), 5.0, 1e-6);
}

TEST("the cache names the nearest vertices") {
  SimplexCache cache{};
  distance(distance_proxy(ground()), distance_proxy(unit_square()), at(23.5f, 4.5f), cache);
  CHECK_EQUAL(cache.count, 1);
  CHECK_EQUAL(cache.edge_indices[0], 0);     // (20, 0)
  CHECK_EQUAL(cache.polygon_indices[0], 0);  // the lower left corner
}

}  // namespace

int main() { return touchdown::check::run_all(); }
