// A small test harness: tests whose names are sentences, and checks that say what they found.
//
//   TEST("one and one are two") { CHECK_EQUAL(1 + 1, 2); }
//   int main() { return touchdown::check::run_all(); }
#pragma once

#include <cmath>
#include <exception>
#include <functional>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

namespace touchdown::check {

struct Test {
  std::string name;
  std::function<void()> body;
};

inline std::vector<Test>& tests() {
  static std::vector<Test> all;
  return all;
}

inline int& failures() {
  static int count = 0;
  return count;
}

struct Registration {
  Registration(const char* name, std::function<void()> body) {
    tests().push_back({name, std::move(body)});
  }
};

inline void report(const char* file, int line, const std::string& complaint) {
  ++failures();
  std::cerr << file << ':' << line << ": " << complaint << '\n';
}

inline void check(bool condition, const char* expression, const char* file, int line) {
  if (!condition) report(file, line, std::string("not true: ") + expression);
}

template <typename A, typename B>
void check_equal(const A& actual, const B& expected, const char* expression, const char* file,
                 int line) {
  if (actual == expected) return;
  report(file, line, std::string(expression) + " is not as expected");
  std::cerr.precision(17);
  std::cerr << "  actual: " << actual << ", expected: " << expected << '\n';
}

inline void check_near(double actual, double expected, double tolerance, const char* expression,
                       const char* file, int line) {
  if (std::fabs(actual - expected) <= tolerance) return;  // false for NaN
  report(file, line, std::string(expression) + " is not near what was expected");
  std::cerr.precision(9);
  std::cerr << "  actual: " << actual << ", expected: " << expected << " ± " << tolerance << '\n';
}

template <typename Exception, typename Body>
void check_throws(const Body& body, const char* expression, const char* file, int line) {
  try {
    body();
  } catch (const Exception&) {
    return;
  }
  report(file, line, std::string("does not throw as expected: ") + expression);
}

// Runs all tests of the program; returns the status for `main`.
inline int run_all() {
  for (const Test& test : tests()) {
    const int before = failures();
    try {
      test.body();
    } catch (const std::exception& error) {
      report(test.name.c_str(), 0, std::string("unexpected exception: ") + error.what());
    }
    if (failures() > before) std::cerr << "FAILED: " << test.name << '\n';
  }
  std::cerr << tests().size() << " tests, " << failures() << " failed checks\n";
  return failures() == 0 ? 0 : 1;
}

}  // namespace touchdown::check

#define TOUCHDOWN_JOIN_(a, b) a##b
#define TOUCHDOWN_JOIN(a, b) TOUCHDOWN_JOIN_(a, b)

#define TEST(name)                                                                     \
  static void TOUCHDOWN_JOIN(test_, __LINE__)();                                       \
  static const touchdown::check::Registration TOUCHDOWN_JOIN(registration_, __LINE__){ \
      name, &TOUCHDOWN_JOIN(test_, __LINE__)};                                         \
  static void TOUCHDOWN_JOIN(test_, __LINE__)()

#define CHECK(condition) touchdown::check::check((condition), #condition, __FILE__, __LINE__)
#define CHECK_EQUAL(actual, expected) \
  touchdown::check::check_equal((actual), (expected), #actual, __FILE__, __LINE__)
#define CHECK_NEAR(actual, expected, tolerance) \
  touchdown::check::check_near((actual), (expected), (tolerance), #actual, __FILE__, __LINE__)
#define CHECK_THROWS(Exception, expression) \
  touchdown::check::check_throws<Exception>([&] { expression; }, #expression, __FILE__, __LINE__)
