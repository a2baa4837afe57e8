// SPDX-License-Identifier: MIT
module;
#include <memory>

#include "io/common/random_bytes.hpp"
module cilantro.io;

import :las_file;

namespace cilantro {

std::unique_ptr<las_records> open_compressed_records(const detail::random_bytes&,
                                                     const las_layout&) {
  throw detail::failure{"compressed", false, 0};
}

}  // namespace cilantro
