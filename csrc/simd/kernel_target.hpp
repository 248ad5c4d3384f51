// What a kernel's source is being compiled for. The build compiles it once per instruction set and
// defines two macros; a source compiled without them is the baseline kernel.
//
// TOUCHDOWN_KERNEL is the name of the instruction set and of the namespace that holds all of the
// kernel's code. Without that namespace, the linker could merge functions of different instruction
// sets. TOUCHDOWN_WIDTH is the number of floats in a vector.
#pragma once

#if !defined(TOUCHDOWN_KERNEL)
#define TOUCHDOWN_KERNEL baseline
#define TOUCHDOWN_WIDTH 4
#endif
