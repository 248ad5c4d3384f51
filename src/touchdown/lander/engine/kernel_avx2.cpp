#define TOUCHDOWN_KERNEL kernel_avx2
#include "lane_kernel.hpp"

namespace touchdown {

extern const Kernel k_avx2{"avx2", 2 * 8, &kernel_avx2::solve<8>};

}  // namespace touchdown
