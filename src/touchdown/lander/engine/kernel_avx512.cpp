#define TOUCHDOWN_KERNEL kernel_avx512
#include "lane_kernel.hpp"

namespace touchdown {

extern const Kernel k_avx512{"avx512", 2 * 16, &kernel_avx512::solve<16>};

}  // namespace touchdown
