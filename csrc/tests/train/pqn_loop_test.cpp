// PQN without Python; tests/training/test_compiled.py compares it with the Python loop.
#include "train/pqn_loop.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "tests/check.hpp"
#include "tests/train/drawn.hpp"

namespace touchdown::train {
namespace {

constexpr std::size_t kNumEnvs = 2, kRoom = 1000, kSteps = 4;  // T = 4
constexpr std::size_t kSize = engine::kObservationSize;

Settings small_settings() {
  Settings settings;
  settings.epsilon_start = 0.5;
  settings.gamma = 0.5;
  settings.learning_rate = 0.01;
  settings.metrics_period = 12;
  settings.max_episode_steps = 18;
  settings.rollout = {.rollout_steps = kSteps, .epochs = 3, .minibatches = 2, .trace_decay = 0.9};
  return settings;
}

// Two landers and everything else that a loop changes.
struct Training {
  Training()
      : loop(small_settings(),
             fused::make_network(engine::kObservationSize, std::array<std::int64_t, 1>{6},
                                 engine::kNumActions, true, false)) {
    for (std::size_t i = 0; i < kNumEnvs; ++i) {
      engine::seed(landers[i], std::vector<std::uint32_t>{static_cast<std::uint32_t>(i)});
    }
    const auto num_params = static_cast<std::size_t>(loop.network().num_params);
    for (auto* each : {&online, &mu, &nu}) each->assign(num_params, 0.0f);
    for (std::size_t i = 0; i < num_params; ++i) online[i] = 0.01f * static_cast<float>(i % 7);
    counts.epsilon = small_settings().epsilon_start;
    reset_those_that_ended();
  }

  auto advance(std::int64_t max_steps) {
    const PqnParts parts{
        .environments = {.landers = landers,
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
        .rollout = {.o_tm1 = o_tm1.data(),
                    .a_tm1 = a_tm1.data(),
                    .r_t = r_t.data(),
                    .o_t = o_t.data(),
                    .terminated = ended.data(),
                    .truncated = truncated.data()},
        .learner = {.online = online.data(), .mu = mu.data(), .nu = nu.data()},
        .q = q.data(),
        .exploration = exploration,
        .replay = replay};
    return loop.advance(parts, max_steps, counts);
  }

  // What Python does after a step that ended an episode.
  void reset_those_that_ended() {
    std::vector<engine::Task> tasks(kNumEnvs, engine::Task::kNothing);
    for (std::size_t i = 0; i < kNumEnvs; ++i) {
      if (landers[i].started != 0 && !terminated[i] && steps[i] < 18) continue;
      tasks[i] = engine::Task::kBegin;
      steps[i] = episode_steps[i] = 0;
    }
    engine::step(landers, throttles, tasks, {results.data(), rewards.data(), terminated.data()},
                 workspaces, workers);
    for (std::size_t i = 0; i < kNumEnvs; ++i) {
      if (tasks[i] != engine::Task::kBegin) continue;
      std::copy_n(results.data() + i * kSize, kSize, observations.data() + i * kSize);
    }
  }

  // Steps of all environments, with resets, at most `at_once` per call.
  void train(std::int64_t num_steps, std::int64_t at_once) {
    const auto wanted = num_steps * static_cast<std::int64_t>(kNumEnvs);
    while (counts.env_steps < wanted) {
      const auto left = (wanted - counts.env_steps) / static_cast<std::int64_t>(kNumEnvs);
      metrics += advance(std::min(at_once, left)).has_value();
      if (!counts.ended) continue;
      reset_those_that_ended();
      metrics += advance(0).has_value();
    }
  }

  PqnLoop loop;
  std::vector<engine::Lander> landers{kNumEnvs, engine::make_lander({})};
  std::vector<engine::Throttle> throttles{kNumEnvs};
  std::vector<engine::Task> step_all{kNumEnvs, engine::Task::kStep};
  std::vector<engine::Workspace> workspaces{1};
  engine::Workers workers{1};
  std::array<std::int64_t, kNumEnvs> actions{}, steps{}, episode_steps{};
  std::array<float, kNumEnvs * kSize> results{}, observations{};
  std::array<double, kNumEnvs> rewards{}, returns{};
  std::array<bool, kNumEnvs> terminated{};
  std::vector<std::int32_t> episode_actions = std::vector<std::int32_t>(kNumEnvs * kRoom);
  std::array<float, kSteps * kNumEnvs * kSize> o_tm1{}, o_t{};
  std::array<std::int32_t, kSteps * kNumEnvs> a_tm1{};
  std::array<float, kSteps * kNumEnvs> r_t{}, ended{}, truncated{};
  std::vector<float> online, mu, nu;
  std::array<float, kNumEnvs * engine::kNumActions> q{};
  engine::Pcg64 explores = seeded(1), orders = seeded(2);
  BitGenerator exploration = bit_generator(explores), replay = bit_generator(orders);
  Counts counts;
  int metrics = 0;
};

TEST("many steps in one call are many calls of one step") {
  Training one, other;
  one.train(90, 1);
  other.train(90, 90);
  CHECK_EQUAL(one.counts.updates, 90 / 4 * 6);
  CHECK_EQUAL(one.metrics, 90 / 4 * 6 / 12);
  CHECK_EQUAL(other.metrics, one.metrics);
  CHECK_EQUAL(one.counts.filled, 2);
  CHECK(one.online == other.online);
  CHECK(one.o_t == other.o_t);
  CHECK(one.explores.next64() == other.explores.next64());
  CHECK(one.orders.next64() == other.orders.next64());
}

TEST("nothing is learned before the rollout is complete") {
  Training training;
  const std::vector<float> before = training.online;
  training.advance(3);
  CHECK_EQUAL(training.counts.filled, 3);
  CHECK(training.online == before);
  training.advance(1);
  CHECK_EQUAL(training.counts.filled, 0);
  CHECK_EQUAL(training.counts.updates, 6);
  CHECK(training.counts.knows_values);
  CHECK(training.online != before);
}

TEST("a rollout holds the steps, and the observation before the reset where an episode ended") {
  Training training;
  training.train(17, 1);
  const auto first = training.steps;
  training.advance(1);  // the 18th step, at the time limit, is the second of a rollout
  CHECK(training.counts.ended);
  CHECK_EQUAL(first[0], 17);
  CHECK_EQUAL(training.r_t[2], static_cast<float>(training.rewards[0]));
  CHECK_EQUAL(training.truncated[2], 1.0f);
  CHECK_EQUAL(training.truncated[0], 0.0f);
  CHECK_EQUAL(training.ended[2], 0.0f);
  CHECK(std::equal(training.results.begin(), training.results.end(),
                   training.o_t.begin() + 2 * kSize));
  CHECK(std::equal(training.o_t.begin(), training.o_t.begin() + 2 * kSize,
                   training.o_tm1.begin() + 2 * kSize));
}

TEST("an action that the network does not have is refused") {
  Training training;
  training.advance(2);
  training.a_tm1[1] = 4;
  CHECK_THROWS(std::invalid_argument, training.advance(2));
}

}  // namespace
}  // namespace touchdown::train

int main() { return touchdown::check::run_all(); }
