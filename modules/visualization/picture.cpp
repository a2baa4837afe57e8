// SPDX-License-Identifier: MIT
module cilantro.visualization;

namespace cilantro {

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return ending;
}

void expect_picture_name(const std::filesystem::path& path) {
  expects(ending_of(path) == ".png", "write_picture: the name of a picture must end in .png");
}

void write_picture(const scene& all, const std::filesystem::path& path,
                   const render_options& options) {
  expect_picture_name(path);
  write_png(render(all, options), path);
}

void write_picture(const scene& all, const view& from, const std::filesystem::path& path,
                   const render_options& options) {
  expect_picture_name(path);
  write_png(render(all, from, options), path);
}

}  // namespace cilantro
