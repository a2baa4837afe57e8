// SPDX-License-Identifier: MIT
export module cilantro.core:buffer;

import cilantro.standard;

namespace cilantro {

namespace detail {
/// From how many bytes on memory is asked for in large pages.
constexpr std::size_t large_memory = std::size_t{4} << 20;

/// Memory that the system is asked to hand out in pages of 2 MB, where it has such: else it clears
/// and counts 512 times as many small ones, by the thread that first writes there, and gives them
/// back one by one, by a single thread. Throws `std::bad_alloc`.
[[nodiscard]] void* allocate_large(std::size_t bytes);
void deallocate_large(void* memory) noexcept;
}  // namespace detail

/// An allocator that leaves new elements of a trivial type uninitialised, for memory that will be
/// written at once; large blocks in large pages.
export template <class T>
struct uninitialized_allocator {
  using value_type = T;

  uninitialized_allocator() = default;
  template <class U>
  uninitialized_allocator(const uninitialized_allocator<U>&) noexcept {}

  /// Room for `n` elements. Throws `std::bad_alloc`.
  [[nodiscard]] T* allocate(std::size_t n) {
    if (!is_large(n)) return std::allocator<T>{}.allocate(n);
    if (n > std::numeric_limits<std::ptrdiff_t>::max() / sizeof(T))
      throw std::bad_array_new_length{};
    return static_cast<T*>(detail::allocate_large(n * sizeof(T)));
  }
  /// Gives back what `allocate(n)` has returned.
  void deallocate(T* memory, std::size_t n) noexcept {
    if (is_large(n))
      detail::deallocate_large(memory);
    else
      std::allocator<T>{}.deallocate(memory, n);
  }
  template <class U>
  void construct(U* p) noexcept(noexcept(U())) {
    ::new (static_cast<void*>(p)) U;
  }
  template <class U, class... Args>
  void construct(U* p, Args&&... args) {
    std::construct_at(p, std::forward<Args>(args)...);
  }
  friend bool operator==(uninitialized_allocator, uninitialized_allocator) { return true; }

 private:
  static constexpr bool is_large(std::size_t n) {
    return n > 0 && n >= detail::large_memory / sizeof(T);
  }
};

/// A `std::vector` whose `resize` does not initialise the elements that it adds.
export template <class T>
using buffer = std::vector<T, uninitialized_allocator<T>>;

}  // namespace cilantro
