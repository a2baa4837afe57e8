// SPDX-License-Identifier: MIT
//
// How a cloud becomes records of LAS points. Internal.
module;
#include "io/common/number.hpp"
#include "io/las/las_record.hpp"
module cilantro.io:las_plan;

import cilantro.standard;
import cilantro.core;
import :cloud_columns;
import :las;

namespace cilantro {

/// A column of the cloud and its place in a record: its values × factor + shift, rounded if the
/// place holds whole numbers.
struct las_placed {
  file_column from;
  std::size_t at = 0;
  detail::number type = detail::number::uint8;  ///< In the file.
  double factor = 1, shift = 0;
  unsigned bit = 0, bits = 0;  ///< Where in a byte, if it is less than one.
};

/// What is to be written, but for the points.
struct las_plan {
  las_info info;  ///< With all records.
  std::vector<las_placed> columns;
};

/// The columns that stand for the coordinates; the last is missing in two dimensions without z.
std::vector<file_column> take_coordinates(std::vector<file_column>& columns, int dimension);

/// Finds the least and the greatest of finite values. Throws `invalid_input` for others.
std::pair<double, double> world_bounds(const file_column& coordinate, index_t size);

/// Chooses scale and offset, and notes the bounds.
void place_coordinates(const std::vector<file_column>& coordinates, index_t size,
                       const las_write_options& options, const las_info* hint, las_plan& plan);
/// Gives each of the other columns a place in the format, or in extra bytes, which it describes.
void place_columns(const std::vector<file_column>& columns, index_t size,
                   const las_write_options& options, las_plan& plan);

/// The records `first` to `first + n` − 1 as bytes, which are zero before.
void encode_las(const las_plan& plan, index_t first, index_t n, char* out);

}  // namespace cilantro
