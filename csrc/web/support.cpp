// What the code needs of its surroundings in a browser: a kernel, memory, and an end to errors.
//
// The C++ runtime's own versions of these would print what went wrong, so that the module would ask
// its page for a console.
#include <__verbose_abort>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "simd/instruction_set.hpp"
#include "web/export.hpp"

// WebAssembly grows its memory up to a limit; beyond it, the call ends with an error.
void* operator new(std::size_t size) {
  void* const block = std::malloc(size == 0 ? 1 : size);
  if (block == nullptr) __builtin_trap();
  return block;
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }

// Nothing is thrown: the arguments have been checked in JavaScript. Code that could throw is shared
// with other builds.
extern "C" void* __cxa_allocate_exception(std::size_t) noexcept { __builtin_trap(); }
extern "C" [[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) { __builtin_trap(); }

void std::__libcpp_verbose_abort(const char*, ...) noexcept { __builtin_trap(); }

namespace touchdown::simd {

// A module of WebAssembly has one instruction set.
InstructionSet chosen() { return InstructionSet::kBaseline; }

}  // namespace touchdown::simd

namespace touchdown::web {

TOUCHDOWN_EXPORT(allocate)
void* allocate(std::size_t size) { return operator new(size); }

TOUCHDOWN_EXPORT(release)
void release(void* block) { operator delete(block); }

}  // namespace touchdown::web
