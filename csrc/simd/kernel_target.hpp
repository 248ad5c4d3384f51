// What a kernel's source is being compiled for. The build compiles it once per instruction set and
// defines
//
//   TOUCHDOWN_KERNEL  the name of the instruction set, which is also the namespace of the kernel's
//   code:
//                     without it, the linker could merge functions of different instruction sets;
//   TOUCHDOWN_WIDTH   the number of floats in a vector.
//
// A source compiled without them is the baseline kernel.
#pragma once

#if !defined(TOUCHDOWN_KERNEL)
#define TOUCHDOWN_KERNEL baseline
#define TOUCHDOWN_WIDTH 4
#endif
