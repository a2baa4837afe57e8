// SPDX-License-Identifier: MIT
//
// Which format the name of a file says. Internal.
module cilantro.io:file_ending;

import cilantro.standard;

namespace cilantro {

enum class ending { ply, pcd, text, csv, pts, npy, raw, las, laz, ptx, e57 };

/// The format of the extension of a path. Throws `invalid_input` naming `who` if there is none.
ending ending_of(const std::filesystem::path& path, const char* who);

}  // namespace cilantro
