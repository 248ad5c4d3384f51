// Training without Python; tests/training/test_compiled.py compares it with the Python loop.
#include "train/loop.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "fused/transition.hpp"
#include "tests/check.hpp"
#include "tests/train/drawn.hpp"

namespace touchdown::train {
namespace {

constexpr std::size_t kNumEnvs = 2, kCapacity = 60, kRoom = 1000, kSteps = 3;
constexpr std::size_t kRecord = fused::transition_fields(engine::kObservationSize).size;

Settings small_settings() {
  Settings settings;
  settings.epsilon_start = 0.5;
  settings.min_size = 10;
  settings.gamma = 0.5;
  settings.learning_rate = 0.01;
  settings.batch_size = 4;
  settings.target_period = 7;
  settings.metrics_period = 5;
  settings.max_episode_steps = 20;
  return settings;
}

// Two landers and everything else that a loop changes.
struct Training {
  explicit Training(const Settings& settings = small_settings())
      : loop(settings, fused::make_network(engine::kObservationSize, std::array<std::int64_t, 1>{6},
                                           engine::kNumActions, false, false)) {
    for (std::size_t i = 0; i < kNumEnvs; ++i) {
      engine::seed(landers[i], std::vector<std::uint32_t>{static_cast<std::uint32_t>(i)});
    }
    const auto num_params = static_cast<std::size_t>(loop.network().num_params);
    for (auto* each : {&online, &target, &mu, &nu}) each->assign(num_params, 0.0f);
    for (std::size_t i = 0; i < num_params; ++i) {
      online[i] = target[i] = 0.01f * static_cast<float>(i % 7) - 0.03f;
    }
    counts.epsilon = settings.epsilon_start;
    reset_those_that_ended();
  }

  Parts parts() {
    return {.environments = {.landers = landers,
                             .throttles = throttles,
                             .tasks = step_all,
                             .workspaces = workspaces,
                             .workers = workers,
                             .actions = actions.data(),
                             .results = {results.data(), rewards.data(), terminated.data()},
                             .steps = steps.data()},
            .episodes = {.observations = observations.data(),
                         .returns = returns.data(),
                         .steps = episode_steps.data(),
                         .actions = episode_actions.data(),
                         .room = kRoom},
            .windows = {.o_tm1 = window_observations.data(),
                        .a_tm1 = window_actions.data(),
                        .r_t = window_rewards.data(),
                        .lengths = window_lengths.data()},
            .memory = {.records = records.data(),
                       .capacity = kCapacity,
                       .num_observations = engine::kObservationSize},
            .learner = {online.data(), target.data(), mu.data(), nu.data()},
            .average = nullptr,
            .q = q.data(),
            .exploration = exploration,
            .replay = replay};
  }

  auto advance(std::int64_t max_steps) { return loop.advance(parts(), max_steps, counts); }

  // What Python does after a step that ended an episode.
  void reset_those_that_ended() {
    std::vector<engine::Task> tasks(kNumEnvs, engine::Task::kNothing);
    for (std::size_t i = 0; i < kNumEnvs; ++i) {
      if (landers[i].started != 0 && !terminated[i] && steps[i] < 20) continue;
      tasks[i] = engine::Task::kBegin;
      steps[i] = episode_steps[i] = 0;
      returns[i] = 0.0;
    }
    engine::step(landers, throttles, tasks, {results.data(), rewards.data(), terminated.data()},
                 workspaces, workers);
    for (std::size_t i = 0; i < kNumEnvs; ++i) {
      if (tasks[i] != engine::Task::kBegin) continue;
      std::copy_n(results.data() + i * engine::kObservationSize, engine::kObservationSize,
                  observations.data() + i * engine::kObservationSize);
    }
  }

  // Steps of all environments, with resets, at most `at_once` per call.
  void train(std::int64_t num_steps, std::int64_t at_once) {
    const auto wanted = counts.env_steps + num_steps * static_cast<std::int64_t>(kNumEnvs);
    while (counts.env_steps < wanted) {
      const auto left = (wanted - counts.env_steps) / static_cast<std::int64_t>(kNumEnvs);
      metrics += advance(std::min(at_once, left)).has_value();
      if (!counts.ended) continue;
      ++stops;
      reset_those_that_ended();
      metrics += advance(0).has_value();
    }
  }

  Loop loop;
  std::vector<engine::Lander> landers{kNumEnvs, engine::make_lander({})};
  std::vector<engine::Throttle> throttles{kNumEnvs};
  std::vector<engine::Task> step_all{kNumEnvs, engine::Task::kStep};
  std::vector<engine::Workspace> workspaces{1};
  engine::Workers workers{1};
  std::array<std::int64_t, kNumEnvs> actions{}, steps{}, episode_steps{};
  std::array<float, kNumEnvs * engine::kObservationSize> results{}, observations{};
  std::array<double, kNumEnvs> rewards{}, returns{};
  std::array<bool, kNumEnvs> terminated{};
  std::array<float, kNumEnvs * kSteps * engine::kObservationSize> window_observations{};
  std::array<std::int32_t, kNumEnvs * kSteps> window_actions{};
  std::array<double, kNumEnvs * kSteps> window_rewards{};
  std::array<std::int64_t, kNumEnvs> window_lengths{};
  std::vector<std::int32_t> episode_actions = std::vector<std::int32_t>(kNumEnvs * kRoom);
  std::vector<float> records = std::vector<float>(kCapacity * kRecord);
  std::vector<float> online, target, mu, nu;
  std::array<float, kNumEnvs * engine::kNumActions> q{};
  engine::Pcg64 explores = seeded(1), samples = seeded(2);
  BitGenerator exploration = bit_generator(explores), replay = bit_generator(samples);
  Counts counts;
  int stops = 0, metrics = 0;
};

TEST("many steps in one call are many calls of one step") {
  Training one, other;
  one.train(90, 1);
  other.train(90, 90);
  CHECK_EQUAL(one.stops, 4);  // both episodes are cut off after 20 steps
  CHECK_EQUAL(other.stops, 4);
  CHECK_EQUAL(one.counts.updates, 2 * (90 - 4));  // none after the first 8 transitions
  CHECK_EQUAL(one.metrics, 172 / 5);
  CHECK_EQUAL(other.metrics, one.metrics);
  CHECK(one.online == other.online);
  CHECK(one.target == other.target);
  CHECK(one.records == other.records);
  CHECK(one.explores.next64() == other.explores.next64());
  CHECK(one.samples.next64() == other.samples.next64());
}

TEST("a step that ends an episode is followed by its updates in the next call") {
  Training training;
  while (!training.counts.ended) training.advance(1);
  CHECK_EQUAL(training.counts.env_steps, 40);
  CHECK_EQUAL(training.counts.episodes, 2);
  const auto before = training.counts.updates;
  training.reset_those_that_ended();
  training.advance(0);
  CHECK(!training.counts.ended);
  CHECK(training.counts.knows_values);
  CHECK_EQUAL(training.counts.updates, before + 2);
}

TEST("the target network is a copy after each period") {
  Training training;
  training.advance(3);                        // 6 environment steps
  CHECK(training.online == training.target);  // nothing has been learnt
  while (training.counts.env_steps < 12) training.advance(1);
  CHECK(training.online != training.target);
  training.advance(1);  // the 14th
  CHECK(training.online == training.target);
}

TEST("a rewarded transition is stored several times, and the newest overwrite the oldest") {
  Settings settings = small_settings();
  settings.resaves = 2;
  settings.resave_threshold = -1e9;
  settings.min_size = 1000;
  Training training(settings);
  training.advance(11);
  CHECK_EQUAL(training.counts.added, 3 * 22);
  const auto record = [&](std::size_t i) {
    return std::vector<float>(
        training.records.begin() + static_cast<std::ptrdiff_t>(i * kRecord),
        training.records.begin() + static_cast<std::ptrdiff_t>((i + 1) * kRecord));
  };
  CHECK(record(0) == record(2));
  CHECK(record(2) != record(3));
  const float* const newest = training.records.data() + 5 * kRecord;
  CHECK_EQUAL(newest[fused::transition_fields(engine::kObservationSize).discount_t], 0.5f);
  CHECK_EQUAL(newest[fused::transition_fields(engine::kObservationSize).r_t],
              static_cast<float>(training.rewards[1]));
}

TEST("a transition of three steps has the discounted sum of their rewards") {
  Settings settings = small_settings();
  settings.n_step = kSteps;
  settings.min_size = 1000;
  Training training(settings);
  double total = 0.0;
  for (const double discount : {1.0, 0.5, 0.25}) {
    CHECK_EQUAL(training.counts.added, 0);
    training.advance(1);
    total += discount * training.rewards[0];
  }
  CHECK_EQUAL(training.counts.added, 2);  // one of each environment
  CHECK_EQUAL(training.window_lengths[0], 2);
  const auto at = fused::transition_fields(engine::kObservationSize);
  CHECK_NEAR(training.records[at.r_t], total, 1e-6);
  CHECK_EQUAL(training.records[at.discount_t], 0.125f);
  while (!training.counts.ended) training.advance(1);  // at the time limit of 20 steps
  CHECK_EQUAL(training.counts.added, 40);
  CHECK_EQUAL(training.window_lengths[0], 0);
  CHECK_EQUAL(training.records[34 * kRecord + at.discount_t], 0.125f);
  CHECK_EQUAL(training.records[35 * kRecord + at.discount_t], 0.25f);
  CHECK_EQUAL(training.records[36 * kRecord + at.discount_t], 0.5f);
}

TEST("a transition of SARSA has the action after it") {
  Settings settings = small_settings();
  settings.rule.sarsa = true;
  settings.min_size = 1000;
  Training training(settings);
  const auto at = fused::transition_fields(engine::kObservationSize);
  const auto action_at = [&](std::size_t record, std::size_t field) {
    std::int32_t action = 0;
    std::memcpy(&action, training.records.data() + record * kRecord + field, sizeof(action));
    return static_cast<std::int64_t>(action);
  };
  training.advance(1);
  CHECK_EQUAL(training.counts.added, 0);
  CHECK_EQUAL(training.window_lengths[0], 1);
  for (std::size_t step = 1; step < 20; ++step) {
    const auto before = training.actions;
    training.advance(1);
    CHECK_EQUAL(action_at(2 * step - 2, at.a_tm1), before[0]);
    CHECK_EQUAL(action_at(2 * step - 2, at.a_t), training.actions[0]);
  }
  CHECK(training.counts.ended);  // at the time limit: the last transitions need no further step
  CHECK_EQUAL(training.counts.added, 40);
  CHECK_EQUAL(training.window_lengths[0], 0);
  CHECK_EQUAL(training.records[39 * kRecord + at.discount_t], 0.5f);
}

TEST("an action that the network does not have is refused") {
  Training training;
  const std::int32_t wrong = 4;
  for (std::size_t i = 0; i < kCapacity; ++i) {
    std::memcpy(training.records.data() + i * kRecord + engine::kObservationSize, &wrong, 4);
  }
  training.counts.added = kCapacity;
  CHECK_THROWS(std::invalid_argument, training.advance(20));
}

}  // namespace
}  // namespace touchdown::train

int main() { return touchdown::check::run_all(); }
