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

/// Values with a name that is unique in its cloud.
export struct attribute {
  std::string name;
  attribute_values values;

  /// The number of values, whatever their type.
  [[nodiscard]] index_t size() const;
  friend bool operator==(const attribute&, const attribute&) = default;
};

/// The values of the given points, in that order. Precondition: all indices are in range.
attribute select(const attribute& all, std::span<const std::int32_t> indices);

/// One value per group. Floating values: the mean of the finite ones, NaN if there are none.
/// Integers: the median (of an even number, the lower one), which is always a value that occurs and
/// equals any label that more than half of the group bears; a mean of labels would be a label of
/// nothing.
attribute reduce(const attribute& all, const point_groups& groups);

/// A name that comes twice among `names`; nothing if all are different. O(n log n).
std::optional<std::string_view> repeated_name(std::vector<std::string_view> names);

/// The values of `a`, then those of `b`. Throws `invalid_input` if their types differ.
attribute concatenate(attribute a, const attribute& b);

}  // namespace cilantro
