#include "train/settings.hpp"

#include "tests/check.hpp"

namespace touchdown::train {
namespace {

TEST("a count passes as many periods as multiples lie in between") {
  CHECK_EQUAL(periods_crossed(0, 3, 4), 0);
  CHECK_EQUAL(periods_crossed(3, 4, 4), 1);
  CHECK_EQUAL(periods_crossed(4, 7, 4), 0);
  CHECK_EQUAL(periods_crossed(3, 12, 4), 3);
}

TEST("epsilon follows its schedule") {
  Settings settings;
  settings.epsilon_start = 1.0;
  settings.epsilon_end = 0.25;
  settings.epsilon_decay = 0.5;
  settings.epsilon_duration = 100;
  CHECK_EQUAL(epsilon_after(settings, 9, 900), 1.0);
  settings.schedule = Schedule::kLinear;
  CHECK_EQUAL(epsilon_after(settings, 9, 0), 1.0);
  CHECK_EQUAL(epsilon_after(settings, 9, 50), 0.625);
  CHECK_EQUAL(epsilon_after(settings, 9, 900), 0.25);
  settings.schedule = Schedule::kExponential;
  CHECK_EQUAL(epsilon_after(settings, 0, 900), 1.0);
  CHECK_EQUAL(epsilon_after(settings, 1, 900), 0.5);
  CHECK_EQUAL(epsilon_after(settings, 3, 900), 0.25);
}

TEST("the learning rate changes in a straight line, then stays") {
  Settings settings;
  settings.learning_rate = 0.5;
  settings.learning_rate_end = 0.25;
  CHECK_EQUAL(learning_rate_after(settings, 1000), 0.5f);
  settings.learning_rate_duration = 100;
  CHECK_EQUAL(learning_rate_after(settings, 0), 0.5f);
  CHECK_EQUAL(learning_rate_after(settings, 50), 0.375f);
  CHECK_EQUAL(learning_rate_after(settings, 1000), 0.25f);
}

}  // namespace
}  // namespace touchdown::train

int main() { return touchdown::check::run_all(); }
