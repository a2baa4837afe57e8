// SPDX-License-Identifier: MIT
export module cilantro.cloud:attribute;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;

namespace cilantro {

/// One value per point, in the type in which it was measured or read: an intensity, a label, a
/// time.
export using attribute_values =
    std::variant<std::vector<std::int8_t>, std::vector<std::uint8_t>, std::vector<std::int16_t>,
                 std::vector<std::uint16_t>, std::vector<std::int32_t>, std::vector<std::uint32_t>,
                 std::vector<float>, std::vector<double>, std::vector<std::int64_t>,
                 std::vector<std::uint64_t>>;

/// One value per point of a cloud, under a `name` that no other attribute of the cloud has. The
/// `values` are of one type.
export struct attribute {
  std::string name;
  attribute_values values;

  /// The number of values, whatever their type.
  [[nodiscard]] index_t size() const;
  friend bool operator==(const attribute&, const attribute&) = default;
};

/// The name of the type of the values, such as "uint8" or "float".
export [[nodiscard]] std::string_view type_name(const attribute_values& values);

/// The fixed-width type in which values of type T are stored.
template <class T>
struct kept_type {
  using type = T;
};
template <>
struct kept_type<bool> {
  using type = std::uint8_t;
};
template <std::integral T>
  requires(!std::same_as<T, bool>)
struct kept_type<T> {
  using type = std::conditional_t<
      sizeof(T) == 8, std::conditional_t<std::is_signed_v<T>, std::int64_t, std::uint64_t>,
      std::conditional_t<
          sizeof(T) == 4, std::conditional_t<std::is_signed_v<T>, std::int32_t, std::uint32_t>,
          std::conditional_t<sizeof(T) == 2,
                             std::conditional_t<std::is_signed_v<T>, std::int16_t, std::uint16_t>,
                             std::conditional_t<std::is_signed_v<T>, std::int8_t, std::uint8_t>>>>;
};

/// A range of numbers of any type that can become the values of an attribute: labels, a mask, what
/// a view computes.
export template <class R>
concept AttributeRange =
    std::ranges::input_range<R> && std::is_arithmetic_v<std::ranges::range_value_t<R>> &&
    !std::convertible_to<R, attribute_values>;

/// The values of the given points, in that order. Precondition: all indices are in range.
attribute select(const attribute& all, std::span<const std::int32_t> indices);

/// One value per group. For floating-point values: the mean of the finite ones, NaN if there are
/// none. For integers: the median (the lower one of two), which is always a value that occurs, and
/// is the label of the majority if more than half of the group has the same; a mean of labels would
/// be meaningless.
attribute reduce(const attribute& all, const point_groups& groups);

/// A name that occurs more than once in `names`; nothing if all are different. O(n log n).
export [[nodiscard]] std::optional<std::string_view> repeated_name(
    std::vector<std::string_view> names);

/// The values of `a`, then those of `b`. Throws `invalid_input` if their types differ.
attribute concatenate(attribute a, const attribute& b);

}  // namespace cilantro
