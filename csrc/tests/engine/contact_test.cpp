#include "engine/contact.hpp"

#include <array>
#include <cstdint>
#include <stdexcept>

#include "engine/contact_manager.hpp"
#include "engine/pcg64.hpp"
#include "engine/world.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::engine;

// A world in which the hull stands on the helipad.
World landed() {
  Pcg64 rng = Pcg64::seeded(std::array<std::uint32_t, 1>{1});
  World world = make_world(make_terrain(rng), -10.0f);
  // the hull's lower side is 10 pixels below its origin
  const auto y = static_cast<float>(world.terrain.heights[kMiddle] + 10.0 / kScale);
  world.bodies[kHull] = body_at(kShapes[kHull], {9.0f, y}, 0.0f);
  return world;
}

Contact& contact_with(World& world, int edge) {
  for (int i = 0; i < world.contacts.count; ++i) {
    Contact& contact = world.contacts.items[static_cast<std::size_t>(i)];
    if (contact.edge == edge && contact.body == kHull) return contact;
  }
  throw std::runtime_error("the pair is not among the contacts");
}

constexpr int kHelipadEdge = 5;  // from x = 8 to x = 10; edge 0 is the base

TEST("bodies high above the moon have no contacts") {
  Pcg64 rng = Pcg64::seeded(std::array<std::uint32_t, 1>{1});
  World world = make_world(make_terrain(rng), -10.0f);
  find_new_contacts(world.contacts, world.terrain, world.bodies);
  CHECK_EQUAL(world.contacts.count, 0);
}

TEST("a pair is found once") {
  World world = landed();
  find_new_contacts(world.contacts, world.terrain, world.bodies);
  const auto count = world.contacts.count;
  CHECK(count > 0);
  find_new_contacts(world.contacts, world.terrain, world.bodies);
  CHECK_EQUAL(world.contacts.count, count);
}

TEST("a hull that touches sets its flag, and it stays set") {
  World world = landed();
  find_new_contacts(world.contacts, world.terrain, world.bodies);
  update_contacts(world.contacts, world.terrain, world.bodies, world.contact_flags);
  CHECK_EQUAL(contact_with(world, kHelipadEdge).touching, 1);
  CHECK_EQUAL(world.contact_flags.hull, 1);
  world.bodies[kHull] = body_at(kShapes[kHull], {9.0f, 12.0f}, 0.0f);
  update_contacts(world.contacts, world.terrain, world.bodies, world.contact_flags);
  CHECK_EQUAL(world.contacts.count, 0);
  CHECK_EQUAL(world.contact_flags.hull, 1);
}

TEST("points that were there before keep their impulses for warm starting") {
  World world = landed();
  find_new_contacts(world.contacts, world.terrain, world.bodies);
  update_contacts(world.contacts, world.terrain, world.bodies, world.contact_flags);
  Contact& contact = contact_with(world, kHelipadEdge);
  CHECK_EQUAL(contact.manifold.count, 2u);
  contact.manifold.points[0].normal_impulse = 3.0f;
  contact.manifold.points[1].tangent_impulse = 4.0f;
  update_contacts(world.contacts, world.terrain, world.bodies, world.contact_flags);
  CHECK_EQUAL(contact.manifold.points[0].normal_impulse, 3.0f);
  CHECK_EQUAL(contact.manifold.points[1].tangent_impulse, 4.0f);
}

TEST("a leg's flag is cleared when it leaves an edge, be it on another one") {
  ContactFlags flags{};
  begin_contact(flags, kLeg1);
  begin_contact(flags, kLeg1);
  CHECK_EQUAL(flags.legs[1], 1);
  end_contact(flags, kLeg1);
  CHECK_EQUAL(flags.legs[1], 0);
  CHECK_EQUAL(flags.legs[0], 0);
}

TEST("a fat box follows a body only once the body has left it") {
  const Shape& leg = kShapes[kLeg0];
  Body body = body_at(leg, {5.0f, 5.0f}, 0.0f);
  const Aabb before = body.fat_aabb;
  const Transform start = body.transform;
  body.transform.origin.x += 0.9f * kAabbExtension;
  synchronize_aabb(body, leg, start);
  CHECK_EQUAL(body.fat_aabb.upper.x, before.upper.x);
  body.transform.origin.x += 0.5f * kAabbExtension;
  synchronize_aabb(body, leg, start);
  // the new place, the margin, and twice the displacement of 0.14 m ahead
  CHECK_NEAR(body.fat_aabb.upper.x, before.upper.x + 3.0 * 0.14, 1e-5);
  CHECK_NEAR(body.fat_aabb.lower.x, before.lower.x, 1e-5);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
