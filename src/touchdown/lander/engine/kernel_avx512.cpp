#define TOUCHDOWN_KERNEL kernel_avx512
#include "lane_kernel.hpp"

namespace touchdown {

extern const Kernel k_avx512{"avx512", kernel_avx512::kGroups * 16, &kernel_avx512::iterate<16>,
                                &kernel_avx512::circle<16>};

}  // namespace touchdown
