#include "engine/manifold.hpp"

#include "engine/contact_solver.hpp"
#include "tests/check.hpp"
#include "tests/engine/shapes_for_tests.hpp"

namespace {

using namespace touchdown::engine;

Manifold manifold_of(const Transform& transform) {
  return collide(ground(), unit_square(), transform);
}

TEST("a square that stands on the ground touches it with the two ends of its lower side") {
  const Manifold manifold = manifold_of(at(5.0f, 0.5f));
  CHECK_EQUAL(manifold.count, 2u);
  CHECK(manifold.face == Face::kEdge);
  CHECK_EQUAL(manifold.local_normal.y, 1.0f);
  for (const ManifoldPoint& point : manifold.points) {
    CHECK_EQUAL(point.local_point.y, -0.5f);
    CHECK_NEAR(std::fabs(point.local_point.x), 0.5, 1e-6);
  }
}

TEST("a square on its corner touches at one point") {
  const Manifold manifold = manifold_of(at(5.0f, std::sqrt(0.5f), 45.0f));
  CHECK_EQUAL(manifold.count, 1u);
  CHECK_NEAR(manifold.points[0].local_point.x, -0.5, 1e-6);
  CHECK_NEAR(manifold.points[0].local_point.y, -0.5, 1e-6);
}

TEST("a side that reaches beyond the edge is cut at the edge's end") {
  const Manifold manifold = manifold_of(at(20.0f, 0.5f));  // half of its side hangs over (20, 0)
  CHECK_EQUAL(manifold.count, 2u);
  float right = manifold.points[0].local_point.x;
  if (manifold.points[1].local_point.x > right) right = manifold.points[1].local_point.x;
  CHECK_NEAR(right, 0.0, 1e-6);
}

TEST("shapes touch as soon as their skins do") {
  const float both_skins = 2.0f * kPolygonRadius;  // 0.02 m
  CHECK_EQUAL(manifold_of(at(5.0f, 0.5f + 0.9f * both_skins)).count, 2u);
  CHECK_EQUAL(manifold_of(at(5.0f, 0.5f + 1.1f * both_skins)).count, 0u);
}

TEST("a square under the edge is pushed downwards") {
  const Manifold manifold = manifold_of(at(5.0f, -0.5f));
  CHECK_EQUAL(manifold.count, 2u);
  CHECK_EQUAL(manifold.local_normal.y, -1.0f);
}

TEST("the two points of a face have different features") {
  const Manifold manifold = manifold_of(at(5.0f, 0.5f));
  CHECK(!(manifold.points[0].feature == manifold.points[1].feature));
}

TEST("a world manifold lies half way between the skins") {
  const Transform transform = at(5.0f, 0.51f);  // the side at 0.01: skins meet at 0.01 and 0
  const WorldManifold placed = place(manifold_of(transform), transform);
  CHECK_NEAR(placed.normal.y, 1.0, 1e-6);
  CHECK_NEAR(placed.points[0].y, 0.005, 1e-6);
  CHECK_NEAR(placed.points[1].y, 0.005, 1e-6);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
