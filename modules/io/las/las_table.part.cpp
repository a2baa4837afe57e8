// SPDX-License-Identifier: MIT
//
// The columns of a cloud that the points of a LAS file become. Internal.
module;
#include "io/common/number.hpp"
#include "io/las/las_record.hpp"
module cilantro.io:las_table;

import cilantro.standard;
import cilantro.core;
import :cloud_builder;
import :las_file;

namespace cilantro {

/// Where an attribute comes from.
struct las_column {
  struct scaling {
    detail::number type = detail::number::uint8;  ///< In the file.
    double scale = 1, offset = 0;
  };
  las::field from;
  std::optional<scaling> scaled = {};
};

struct las_table {
  std::vector<file_field> fields;   ///< Coordinates, colours if there are any, attributes.
  std::vector<las_column> columns;  ///< Of the attributes.
  std::size_t first_column = 0;     ///< The field of the first of them.
};
las_table las_table_of(const las_layout& layout);

/// The medians of the coordinates of some points, rounded to whole numbers; 0 where they are not
/// finite.
Eigen::Vector3d sampled_middle(const las_records& records, const las_info& info);

}  // namespace cilantro
