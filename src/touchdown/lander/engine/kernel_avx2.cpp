#define TOUCHDOWN_KERNEL kernel_avx2
#include "lane_kernel.hpp"

namespace touchdown {

extern const Kernel k_avx2{"avx2", kernel_avx2::kGroups * 8, &kernel_avx2::iterate<8>,
                                &kernel_avx2::circle<8>};

}  // namespace touchdown
