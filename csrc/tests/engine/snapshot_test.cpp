#include "engine/snapshot.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "tests/check.hpp"
#include "tests/engine/flying.hpp"

namespace {

using namespace touchdown::engine;

// After 60 steps of free fall, in an episode with wind.
Lander falling() {
  Config config;
  config.enable_wind = 1;
  Lander lander = seeded_lander(5, config);
  begin_alone(lander);
  for (int i = 0; i < 60; ++i) step_alone(lander, {});
  return lander;
}

TEST("a restored lander flies on identically, over a new episode too") {
  Lander lander = falling();
  Lander copy = restored(snapshot(lander), lander.config);
  CHECK(std::memcmp(&lander, &copy, sizeof(Lander)) == 0);
  for (int i = 0; i < 50; ++i) {
    CHECK(step_alone(lander, {}).observation == step_alone(copy, {}).observation);
  }
  CHECK(begin_alone(lander).observation == begin_alone(copy).observation);
}

TEST("a damaged snapshot is refused") {
  const Lander lander = falling();
  std::vector<std::byte> bytes = snapshot(lander);
  bytes.back() ^= std::byte{1};
  CHECK_THROWS(std::invalid_argument, restored(bytes, lander.config));
}

TEST("a snapshot that is cut off is refused") {
  const Lander lander = falling();
  std::vector<std::byte> bytes = snapshot(lander);
  bytes.pop_back();
  CHECK_THROWS(std::invalid_argument, restored(bytes, lander.config));
  bytes.resize(3);
  CHECK_THROWS(std::invalid_argument, restored(bytes, lander.config));
}

TEST("a snapshot of a lander with other settings is refused") {
  const Lander lander = falling();
  Config other = lander.config;
  other.gravity = -3.0;
  CHECK_THROWS(std::invalid_argument, restored(snapshot(lander), other));
}

TEST("indices out of range are refused though the checksum fits") {
  Lander lander = falling();
  lander.world.contacts.count = kMaxContacts + 1;
  CHECK_THROWS(std::invalid_argument, restored(snapshot(lander), lander.config));
}

TEST("two contacts of one pair are refused, as a third body would find no room") {
  Lander lander = falling();
  lander.world.contacts.count = 2;
  lander.world.contacts.items[0] = lander.world.contacts.items[1] = {};
  CHECK_THROWS(std::invalid_argument, restored(snapshot(lander), lander.config));
  lander.world.contacts.items[1].edge = 1;
  CHECK(restored(snapshot(lander), lander.config).world.contacts.count == 2);
}

TEST("a gust of wind that would overflow its count is refused") {
  Lander lander = falling();
  lander.torque_index = std::numeric_limits<std::int64_t>::max();
  CHECK_THROWS(std::invalid_argument, restored(snapshot(lander), lander.config));
}

}  // namespace

int main() { return touchdown::check::run_all(); }
