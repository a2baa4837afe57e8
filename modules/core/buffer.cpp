// SPDX-License-Identifier: MIT
module;
#include <sys/mman.h>

#include <cstdlib>
module cilantro.core;

namespace cilantro::detail {

void* allocate_large(std::size_t bytes) {
  constexpr std::size_t page = std::size_t{2} << 20;
  void* const memory = std::aligned_alloc(page, (bytes + page - 1) / page * page);
  if (memory == nullptr) throw std::bad_alloc{};
#ifdef MADV_HUGEPAGE
  // Whole pages only, so that no more memory is touched than asked for. A system that has none
  // refuses, which is no harm.
  ::madvise(memory, bytes / page * page, MADV_HUGEPAGE);
#endif
  return memory;
}

void deallocate_large(void* memory) noexcept {
  std::free(memory);
}

}  // namespace cilantro::detail
