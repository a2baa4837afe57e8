// SPDX-License-Identifier: MIT
//
// The part of the standard library that the interfaces use, as a module: its headers are read here
// and nowhere else, so that an interface costs a twentieth of a second instead of two. Internal:
// not exported to users, who include the standard headers as they like. Why not `import std`:
// docs/decisions/0004-standard-library-wrapped-once.md
module;
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <compare>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <iosfwd>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <ranges>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>
export module cilantro.standard;

// NOLINTBEGIN(bugprone-std-namespace-modification): declared anew, not modified.
export namespace std {

using std::allocator;
using std::array;
using std::atomic_ref;
using std::bad_array_new_length;
using std::basic_string;
using std::byte;
using std::exception_ptr;
using std::function;
using std::holds_alternative;
using std::initializer_list;
using std::invalid_argument;
using std::mutex;
using std::numeric_limits;
using std::optional;
using std::ostream;
using std::pair;
using std::runtime_error;
using std::scoped_lock;
using std::shared_ptr;
using std::span;
using std::stop_token;
using std::string;
using std::string_view;
using std::tuple;
using std::unique_ptr;
using std::variant;
using std::vector;

using std::int16_t;
using std::int32_t;
using std::int64_t;
using std::int8_t;
using std::ptrdiff_t;
using std::size_t;
using std::uint16_t;
using std::uint32_t;
using std::uint64_t;
using std::uint8_t;
using std::uintptr_t;

using std::conditional_t;
using std::index_sequence;
using std::index_sequence_for;
using std::invoke_result_t;
using std::is_lvalue_reference_v;
using std::is_nothrow_move_constructible_v;
using std::remove_cvref_t;
using std::remove_reference_t;
using std::type_identity_t;

using std::constructible_from;
using std::convertible_to;
using std::copy_constructible;
using std::copyable;
using std::derived_from;
using std::floating_point;
using std::integral;
using std::invocable;
using std::movable;
using std::permutable;
using std::predicate;
using std::same_as;
using std::uniform_random_bit_generator;

using std::default_sentinel;
using std::default_sentinel_t;
using std::input_iterator_tag;
using std::random_access_iterator_tag;

using std::abs;
using std::all_of;
using std::apply;
using std::as_const;
using std::asin;
using std::atan2;
using std::bit_cast;
using std::cbrt;
using std::cmp_greater_equal;
using std::cmp_less;
using std::construct_at;
using std::copy_n;
using std::current_exception;
using std::declval;
using std::erase_if;
using std::exchange;
using std::exp;
using std::floor;
using std::forward;
using std::get;
using std::get_if;
using std::in_range;
using std::invoke;
using std::is_arithmetic_v;
using std::is_class_v;
using std::is_const_v;
using std::is_invocable_r_v;
using std::is_pointer_v;
using std::is_signed_v;
using std::isfinite;
using std::isnan;
using std::ldexp;
using std::lexicographical_compare;
using std::log;
using std::make_index_sequence;
using std::make_shared;
using std::make_unique;
using std::max;
using std::memory_order_relaxed;
using std::min;
using std::move;
using std::nextafter;
using std::nullopt;
using std::pow;
using std::remainder;
using std::rethrow_exception;
using std::sin;
using std::sqrt;
using std::ssize;
using std::swap;
using std::to_string;
using std::tuple_cat;
using std::tuple_element_t;
using std::tuple_size_v;
using std::visit;

using std::operator==;
using std::operator<=>;
using std::operator+;
using std::operator-;
using std::operator<<;

using std::partial_ordering;
using std::strong_ordering;

namespace chrono {
using std::chrono::duration;
using std::chrono::steady_clock;
}  // namespace chrono

namespace filesystem {
using std::filesystem::path;
}  // namespace filesystem

namespace ranges {
using std::ranges::adjacent_find;
using std::ranges::all_of;
using std::ranges::any_of;
using std::ranges::begin;
using std::ranges::borrowed_range;
using std::ranges::contiguous_range;
using std::ranges::copy;
using std::ranges::data;
using std::ranges::distance;
using std::ranges::enable_borrowed_range;
using std::ranges::enable_view;
using std::ranges::end;
using std::ranges::equal;
using std::ranges::find;
using std::ranges::find_if;
using std::ranges::forward_range;
using std::ranges::input_range;
using std::ranges::is_sorted;
using std::ranges::iter_swap;
using std::ranges::iterator_t;
using std::ranges::lower_bound;
using std::ranges::make_heap;
using std::ranges::partial_sort;
using std::ranges::pop_heap;
using std::ranges::push_heap;
using std::ranges::random_access_range;
using std::ranges::range;
using std::ranges::range_reference_t;
using std::ranges::range_value_t;
using std::ranges::sentinel_t;
using std::ranges::size;
using std::ranges::sized_range;
using std::ranges::sort;
using std::ranges::ssize;
using std::ranges::upper_bound;
using std::ranges::view;
using std::ranges::view_interface;
using std::ranges::viewable_range;
#if defined(__cpp_lib_ranges) && __cpp_lib_ranges >= 202202L
using std::ranges::range_adaptor_closure;
#endif
namespace views {
using std::ranges::views::all;
using std::ranges::views::all_t;
using std::ranges::views::iota;
using std::ranges::views::transform;
}  // namespace views
}  // namespace ranges
namespace views = ranges::views;

}  // namespace std
// NOLINTEND(bugprone-std-namespace-modification)

#ifdef __GLIBCXX__
// Where libstdc++ keeps the operators of its iterators.
export namespace __gnu_cxx {
using __gnu_cxx::operator==;
using __gnu_cxx::operator<=>;
using __gnu_cxx::operator+;
using __gnu_cxx::operator-;
}  // namespace __gnu_cxx
#endif
