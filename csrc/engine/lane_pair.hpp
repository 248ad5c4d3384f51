// Two vectors that are computed side by side. A constraint is one long chain of operations, each of
// which waits for the one before; with a second chain between its links, the processor need not.
#pragma once

#include <type_traits>

#include "engine/lanes.hpp"

namespace touchdown::engine {

// Of floats, or of the integers that a comparison gives.
template <typename V>
struct Pair {
  V first;
  V second;
};

template <typename T>
concept Number = std::is_arithmetic_v<T>;

template <typename V>
constexpr Pair<V> operator-(Pair<V> a) {
  return {-a.first, -a.second};
}
template <typename V>
constexpr Pair<V> operator~(Pair<V> a) {
  return {~a.first, ~a.second};
}
template <typename V>
constexpr Pair<V> operator+(Pair<V> a, Pair<V> b) {
  return {a.first + b.first, a.second + b.second};
}
template <typename V, Number S>
constexpr Pair<V> operator+(Pair<V> a, S b) {
  return {a.first + b, a.second + b};
}
template <typename V>
constexpr Pair<V> operator-(Pair<V> a, Pair<V> b) {
  return {a.first - b.first, a.second - b.second};
}
template <typename V, Number S>
constexpr Pair<V> operator-(S a, Pair<V> b) {
  return {a - b.first, a - b.second};
}
template <typename V>
constexpr Pair<V> operator*(Pair<V> a, Pair<V> b) {
  return {a.first * b.first, a.second * b.second};
}
template <typename V>
constexpr Pair<V>& operator+=(Pair<V>& a, Pair<V> b) {
  return a = a + b;
}
template <typename V>
constexpr Pair<V>& operator-=(Pair<V>& a, Pair<V> b) {
  return a = a - b;
}
template <typename V>
constexpr Pair<V>& operator|=(Pair<V>& a, Pair<V> b) {
  return a = {a.first | b.first, a.second | b.second};
}

template <typename V>
constexpr auto operator<(Pair<V> a, Pair<V> b) {
  return Pair<decltype(a.first < b.first)>{a.first < b.first, a.second < b.second};
}
template <typename V, Number S>
constexpr auto operator>=(Pair<V> a, S b) {
  return Pair<decltype(a.first >= b)>{a.first >= b, a.second >= b};
}
template <typename M>
constexpr Pair<M> operator&&(Pair<M> a, Pair<M> b) {
  return {a.first && b.first, a.second && b.second};
}
template <typename M>
constexpr Pair<M> operator||(Pair<M> a, Pair<M> b) {
  return {a.first || b.first, a.second || b.second};
}

template <typename M>
inline bool any(Pair<M> mask) {
  return any(mask.first | mask.second);
}
template <typename M, typename V>
inline Pair<V> pick(Pair<M> condition, Pair<V> a, Pair<V> b) {
  return {pick(condition.first, a.first, b.first), pick(condition.second, a.second, b.second)};
}
template <typename V>
inline Pair<V> smaller(Pair<V> a, Pair<V> b) {
  return {smaller(a.first, b.first), smaller(a.second, b.second)};
}
template <typename V>
inline Pair<V> larger(Pair<V> a, Pair<V> b) {
  return {larger(a.first, b.first), larger(a.second, b.second)};
}

}  // namespace touchdown::engine
