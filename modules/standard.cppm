// SPDX-License-Identifier: MIT
//
// The part of the standard library that cilantro uses, as a module: its headers are read here and
// nowhere else, so that an interface costs a twentieth of a second instead of two, and a unit a
// fifth of a second less. Internal: not exported to users, who include the standard headers as they
// like. Why not `import std`: docs/decisions/0004-standard-library-wrapped-once.md
module;
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>
#include <compare>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <iosfwd>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <numbers>
#include <numeric>
#include <optional>
#include <ranges>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <system_error>
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
using std::atomic;
using std::atomic_ref;
using std::bad_alloc;
using std::bad_array_new_length;
using std::basic_string;
using std::byte;
using std::chars_format;
using std::endian;
using std::errc;
using std::error_code;
using std::exception;
using std::exception_ptr;
using std::function;
using std::greater;
using std::holds_alternative;
using std::initializer_list;
using std::invalid_argument;
using std::less;
using std::lock_guard;
using std::logic_error;
using std::map;
using std::mutex;
using std::negate;
using std::numeric_limits;
using std::once_flag;
using std::optional;
using std::ostream;
using std::pair;
using std::runtime_error;
using std::scoped_lock;
using std::shared_ptr;
using std::span;
using std::stop_source;
using std::stop_token;
using std::string;
using std::string_view;
using std::system_error;
using std::tuple;
using std::unique_lock;
using std::unique_ptr;
using std::variant;
using std::vector;

using std::int16_t;
using std::int32_t;
using std::int64_t;
using std::int8_t;
using std::intptr_t;
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
using std::is_invocable_v;
using std::is_lvalue_reference_v;
using std::is_nothrow_move_constructible_v;
using std::milli;
using std::remove_cvref_t;
using std::remove_reference_t;
using std::type_identity_t;
using std::variant_alternative_t;
using std::variant_size_v;

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
using std::accumulate;
using std::acos;
using std::adjacent_difference;
using std::all_of;
using std::any_of;
using std::apply;
using std::as_bytes;
using std::as_const;
using std::asin;
using std::atan2;
using std::back_inserter;
using std::bit_cast;
using std::bit_width;
using std::call_once;
using std::cbrt;
using std::ceil;
using std::clamp;
using std::cmp_equal;
using std::cmp_greater_equal;
using std::cmp_less;
using std::cmp_less_equal;
using std::cmp_not_equal;
using std::construct_at;
using std::copy;
using std::copy_n;
using std::cos;
using std::countl_one;
using std::countr_zero;
using std::current_exception;
using std::declval;
using std::end;
using std::erase_if;
using std::exchange;
using std::exclusive_scan;
using std::exp;
using std::exp2;
using std::fill;
using std::fill_n;
using std::find;
using std::floor;
using std::fmin;
using std::fmod;
using std::forward;
using std::frexp;
using std::from_chars;
using std::gcd;
using std::generic_category;
using std::get;
using std::get_if;
using std::hypot;
using std::in_range;
using std::invoke;
using std::iota;
using std::is_arithmetic_v;
using std::is_class_v;
using std::is_const_v;
using std::is_invocable_r_v;
using std::is_pointer_v;
using std::is_signed_v;
using std::isfinite;
using std::isinf;
using std::isnan;
using std::iter_swap;
using std::ldexp;
using std::lexicographical_compare;
using std::lexicographical_compare_three_way;
using std::lgamma;
using std::llround;
using std::log;
using std::log10;
using std::log1p;
using std::log2;
using std::lower_bound;
using std::lround;
using std::make_index_sequence;
using std::make_move_iterator;
using std::make_shared;
using std::make_unique;
using std::make_unique_for_overwrite;
using std::max;
using std::memcmp;
using std::memcpy;
using std::memory_order_acquire;
using std::memory_order_relaxed;
using std::memory_order_release;
using std::memset;
using std::merge;
using std::min;
using std::min_element;
using std::minmax;
using std::move;
using std::nextafter;
using std::nth_element;
using std::nullopt;
using std::partial_sum;
using std::popcount;
using std::pow;
using std::prev;
using std::remainder;
using std::rethrow_exception;
using std::rotate;
using std::round;
using std::sin;
using std::size;
using std::sort;
using std::sqrt;
using std::ssize;
using std::swap;
using std::tan;
using std::tie;
using std::to_chars;
using std::to_integer;
using std::to_string;
using std::tuple_cat;
using std::tuple_element;
using std::tuple_element_t;
using std::tuple_size;
using std::tuple_size_v;
using std::unique;
using std::visit;

using std::operator==;
using std::operator<=>;
using std::operator+;
using std::operator-;
using std::operator<<;
using std::operator>>;
using std::operator&;
using std::operator|;

using std::partial_ordering;
using std::strong_ordering;

namespace chrono {
using std::chrono::duration;
using std::chrono::duration_cast;
using std::chrono::milliseconds;
using std::chrono::operator*;
using std::chrono::operator+;
using std::chrono::operator-;
using std::chrono::operator/;
using std::chrono::operator<=>;
using std::chrono::operator==;
using std::chrono::steady_clock;
}  // namespace chrono

namespace filesystem {
using std::filesystem::create_directories;
using std::filesystem::directory_iterator;
using std::filesystem::exists;
using std::filesystem::file_size;
using std::filesystem::is_directory;
using std::filesystem::last_write_time;
using std::filesystem::path;
using std::filesystem::remove;
using std::filesystem::remove_all;
using std::filesystem::resize_file;
using std::filesystem::weakly_canonical;
}  // namespace filesystem

namespace numbers {
using std::numbers::pi;
using std::numbers::pi_v;
}  // namespace numbers

namespace ranges {
using std::ranges::adjacent_find;
using std::ranges::all_of;
using std::ranges::any_of;
using std::ranges::begin;
using std::ranges::borrowed_range;
using std::ranges::contiguous_range;
using std::ranges::copy;
using std::ranges::count;
using std::ranges::count_if;
using std::ranges::data;
using std::ranges::distance;
using std::ranges::enable_borrowed_range;
using std::ranges::enable_view;
using std::ranges::end;
using std::ranges::equal;
using std::ranges::equal_range;
using std::ranges::fill;
using std::ranges::find;
using std::ranges::find_if;
using std::ranges::forward_range;
using std::ranges::greater;
using std::ranges::includes;
using std::ranges::input_range;
using std::ranges::is_sorted;
using std::ranges::iter_swap;
using std::ranges::iterator_t;
using std::ranges::lexicographical_compare;
using std::ranges::lower_bound;
using std::ranges::make_heap;
using std::ranges::max;
using std::ranges::max_element;
using std::ranges::merge;
using std::ranges::min;
using std::ranges::min_element;
using std::ranges::move;
using std::ranges::none_of;
using std::ranges::nth_element;
using std::ranges::partial_sort;
using std::ranges::partition;
using std::ranges::pop_heap;
using std::ranges::push_heap;
using std::ranges::random_access_range;
using std::ranges::range;
using std::ranges::range_reference_t;
using std::ranges::range_value_t;
using std::ranges::replace;
using std::ranges::replace_if;
using std::ranges::reverse;
using std::ranges::rotate;
using std::ranges::sentinel_t;
using std::ranges::set_intersection;
using std::ranges::size;
using std::ranges::sized_range;
using std::ranges::sort;
using std::ranges::ssize;
using std::ranges::transform;
using std::ranges::unique;
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
using std::ranges::views::reverse;
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
