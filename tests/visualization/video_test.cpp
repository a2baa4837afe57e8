// SPDX-License-Identifier: MIT
//
// Films, read again as files, and everything that goes wrong when another program writes them.
#include <doctest/doctest.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stop_token>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

import cilantro.visualization;
import test_support;

using namespace cilantro;
namespace fs = std::filesystem;

namespace {

/// Colours that differ from pixel to pixel and from frame to frame.
image<rgb> frame_of(int width, int height, int number = 0) {
  image<rgb> frame(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      frame(x, y) = {std::uint8_t(37 * x + 11 * number), std::uint8_t(53 * y), std::uint8_t(x * y)};
  return frame;
}

/// Another value of an environment variable, while this lives.
class with_environment {
 public:
  with_environment(const char* name, const std::string& value) : name_{name} {
    if (const char* now = std::getenv(name)) before_ = now;
    ::setenv(name, value.c_str(), 1);
  }
  with_environment(const with_environment&) = delete;
  with_environment& operator=(const with_environment&) = delete;
  ~with_environment() { ::setenv(name_, before_.c_str(), 1); }

 private:
  const char* name_;
  std::string before_;
};

/// A program ffmpeg that is a script of one's own. It finds no other programs.
class with_own_ffmpeg {
 public:
  explicit with_own_ffmpeg(const std::string& script) {
    test::write_file(folder_ / "ffmpeg", "#!/bin/sh\n" + script);
    fs::permissions(folder_ / "ffmpeg", fs::perms::owner_all);
  }

 private:
  test::temporary_folder folder_;
  with_environment path_{"PATH", folder_.path().string()};
};

/// No file may become larger than so many bytes, while this lives.
class with_full_disk {
 public:
  explicit with_full_disk(rlim_t most) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{most, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  with_full_disk(const with_full_disk&) = delete;
  with_full_disk& operator=(const with_full_disk&) = delete;
  ~with_full_disk() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

std::string printed_by(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen(command.c_str(), "r");
  REQUIRE(pipe);
  for (int c = 0; (c = std::fgetc(pipe)) != EOF;) text += char(c);
  ::pclose(pipe);
  return text;
}
bool has_ffmpeg() {
  static const bool found =
      std::system("ffmpeg -version > /dev/null 2>&1 && ffprobe -version > /dev/null 2>&1") == 0;
  if (!found) MESSAGE("skipped: ffmpeg and ffprobe are not installed");
  return found;
}
/// Width, height, pixels, frames per second and frames of a film, decoded.
std::string probed(const fs::path& film) {
  auto text = printed_by(
      "ffprobe -v error -count_frames -select_streams v -of csv=p=0 "
      "-show_entries stream=codec_name,width,height,pix_fmt,r_frame_rate,"
      "nb_read_frames '" +
      film.string() + "' 2>&1");
  while (!text.empty() && (text.back() == '\n' || text.back() == ',')) text.pop_back();
  return text;
}

/// The sentence of the error.
template <class Error, class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  } catch (const std::exception& error) {
    return std::string{"another error: "} + error.what();
  }
  return "no error";
}
bool says(const std::string& sentence, const std::string& words) {
  if (sentence.find(words) != std::string::npos) return true;
  MESSAGE("it says: " << sentence);
  return false;
}

auto open_files() {
  return std::distance(fs::directory_iterator{"/proc/self/fd"}, fs::directory_iterator{});
}
/// Neither children, running or not, nor descriptors are left behind.
class leaves_nothing {
 public:
  leaves_nothing() = default;
  leaves_nothing(const leaves_nothing&) = delete;
  leaves_nothing& operator=(const leaves_nothing&) = delete;
  ~leaves_nothing() {
    CHECK(::waitpid(-1, nullptr, WNOHANG) == -1);
    CHECK(open_files() == files_);
  }

 private:
  std::ptrdiff_t files_ = open_files();
};

scene one_square() {
  triangle_batch mesh{.colors = one_color({200, 40, 90})};
  mesh.points.resize(3, 3);
  mesh.points << 0, 1, 0, 0, 0, 1, 0, 0, 0.5f;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  return std::move(scene{}.set("mesh", mesh));
}

}  // namespace

TEST_CASE("an uncompressed film has the header, and each colour as the standard has it") {
  const test::temporary_folder folder;
  const int width = 7, height = 5;
  std::vector<image<rgb>> frames{frame_of(width, height, 1), frame_of(width, height, 2)};
  // Known from the definition.
  frames[0](0, 0) = {255, 255, 255};
  frames[0](1, 0) = {0, 0, 0};
  frames[0](2, 0) = {255, 0, 0};
  frames[0](3, 0) = {0, 255, 0};
  frames[0](4, 0) = {0, 0, 255};
  video film{folder / "film.Y4M", {.frames_per_second = 30000 / 1001.0}};
  for (const auto& frame : frames) film.add(frame);
  film.finish();

  const auto bytes = test::read_file(folder / "film.Y4M");
  const std::string header = "YUV4MPEG2 W7 H5 F30000:1001 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
  constexpr std::size_t pixels = width * height;
  REQUIRE(bytes.size() == header.size() + 2 * (6 + 3 * pixels));
  CHECK(bytes.substr(0, header.size()) == header);
  const auto value = [&](std::size_t frame, std::size_t plane, std::size_t pixel) {
    const std::size_t begin = header.size() + frame * (6 + 3 * pixels) + 6;
    return int(std::uint8_t(bytes[begin + plane * pixels + pixel]));
  };
  constexpr int known[5][3] = {
      {235, 128, 128}, {16, 128, 128}, {81, 90, 240}, {145, 54, 34}, {41, 240, 110}};
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t k = 0; k < 3; ++k) CHECK(value(0, k, i) == known[i][k]);
  for (std::size_t f = 0; f < 2; ++f) {
    CHECK(bytes.substr(header.size() + f * (6 + 3 * pixels), 6) == "FRAME\n");
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto [r, g, b] = frames[f].pixels()[i];
      const double luma = 0.299 * r + 0.587 * g + 0.114 * b;
      // Half a step, and what doubles err by.
      CHECK(std::abs(value(f, 0, i) - (16 + 219 * luma / 255)) < 0.5001);
      CHECK(std::abs(value(f, 1, i) - (128 + 224 / 1.772 * (b - luma) / 255)) < 0.5001);
      CHECK(std::abs(value(f, 2, i) - (128 + 224 / 1.402 * (r - luma) / 255)) < 0.5001);
    }
  }
  if (has_ffmpeg()) CHECK(probed(folder / "film.Y4M") == "rawvideo,7,5,yuv444p,30000/1001,2");
}

TEST_CASE("rates are kept as fractions") {
  const test::temporary_folder folder;
  for (const auto& [rate, text] : {std::pair{30.0, "F30:1 "},
                                   {0.5, "F1:2 "},
                                   {12.5, "F25:2 "},
                                   {29.97, "F2997:100 "},
                                   {24000 / 1001.0, "F24000:1001 "}}) {
    video film{folder / "film.y4m", {.frames_per_second = rate}};
    film.add(frame_of(2, 2));
    film.finish();
    CHECK(says(test::read_file(folder / "film.y4m"), text));
  }
  for (const double rate : {0.0, -1.0, 1001.0, test::nan<double>})
    CHECK_THROWS_AS((video{folder / "film.y4m", {.frames_per_second = rate}}), invalid_input);
}

TEST_CASE("numbered pictures are those that are rendered") {
  const test::temporary_folder folder;
  const auto all = one_square();
  const auto views = turntable(fit(all, {.width = 40, .height = 30}), 11);
  write_video(all, views, folder / "%%s 100% %03d.png");
  write_video(all, views, folder / "%d.PNG");
  CHECK(folder.count() == 22);
  for (int i = 0; i < 11; ++i) {
    const std::string number = std::to_string(i);
    const auto expected = render(all, views[i]);
    CHECK(read_color_image(folder / ("%%s 100% " + std::string(3 - number.size(), '0') + number +
                                     ".png")) == expected);
    CHECK(read_color_image(folder / (number + ".PNG")) == expected);
  }
}

TEST_CASE("a compressed film has the frames, their size and their colours") {
  if (!has_ffmpeg()) return;
  const test::temporary_folder folder;
  const leaves_nothing nothing;
  image<rgb> plain(64, 48, {200, 60, 20});
  video film{folder / "film.mp4", {.frames_per_second = 24}};
  for (int i = 0; i < 30; ++i) film.add(plain);
  CHECK(!fs::exists(folder / "film.mp4"));
  film.finish();
  CHECK(folder.count() == 1);
  CHECK(probed(folder / "film.mp4") == "h264,64,48,yuv420p,24/1,30");

  std::system(("cd '" + folder.path().string() +
               "' && ffmpeg -nostdin -loglevel error -i film.mp4 -frames:v 1 first.png")
                  .c_str());
  const auto [red, green, blue] = read_color_image(folder / "first.png")(30, 20);
  CHECK(std::abs(red - 200) <= 3);
  CHECK(std::abs(green - 60) <= 3);
  CHECK(std::abs(blue - 20) <= 3);
}

TEST_CASE("the last column and row of a compressed film of an odd size are doubled") {
  if (!has_ffmpeg()) return;
  const test::temporary_folder folder;
  for (const auto& [width, height, size] :
       {std::tuple{63, 47, "64,48"}, {63, 48, "64,48"}, {64, 47, "64,48"}, {1, 1, "2,2"}}) {
    video film{folder / "film.mp4"};
    for (int i = 0; i < 3; ++i) film.add(frame_of(width, height, i));
    film.finish();
    CHECK(says(probed(folder / "film.mp4"), std::string{"h264,"} + size + ",yuv420p,30/1,3"));
  }
}

TEST_CASE("names are names, whatever is in them") {
  const test::temporary_folder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  for (const std::string name : {"-y", "a:b", "http:", "%d%s%n", "pipe:1", "'$(exit)\"`", "a\nb"}) {
    for (const std::string ending : {".y4m", ".mp4"}) {
      if (ending == ".mp4" && !has_ffmpeg()) continue;
      video film{name + ending};
      film.add(frame_of(16, 16));
      film.finish();
      CHECK(fs::file_size(fs::path{name + ending}) > 500);
    }
  }
  CHECK(folder.count() == (has_ffmpeg() ? 14 : 7));
  fs::current_path(before);
}

TEST_CASE("names that say nothing of the kind of film are refused, with what there is") {
  const test::temporary_folder folder;
  for (const std::string name :
       {"film", "film.avi", "film.png", "film%4d.png", "film%0d.png", "film%d%d.png", "film%05.png",
        "%d/film.png", "mp4", ".mp4", "film.mp4/", ""})
    CHECK(says(error_of<invalid_input>([&] { video{folder.path() / name}; }), "%04d"));
  CHECK(folder.count() == 0);
  CHECK(says(error_of<io_error>([&] { video{folder / "missing/film.y4m"}; }), "No such file"));
  CHECK(says(error_of<io_error>([&] { video{folder / "missing/film.mp4"}; }), "No such file"));
  video numbered{folder / "missing/%d.png"};
  CHECK(says(error_of<io_error>([&] { numbered.add(frame_of(2, 2)); }), "No such file"));
}

TEST_CASE("an unfinished film leaves what was there") {
  const test::temporary_folder folder;
  for (const std::string name : {"film.y4m", "film.mp4"}) {
    if (name == "film.mp4" && !has_ffmpeg()) continue;
    const leaves_nothing nothing;
    test::write_file(folder / name, "before");
    {
      video film{folder / name};
      CHECK(says(error_of<invalid_input>([&] { film.finish(); }), "at least one frame"));
      for (int i = 0; i < 20; ++i) film.add(frame_of(160, 120, i));
      // What is wrong with one frame spoils no film.
      CHECK(says(error_of<invalid_input>([&] { film.add(frame_of(160, 119)); }), "160 x 120"));
      CHECK_THROWS_AS(film.add({}), invalid_input);
      film.add(frame_of(160, 120));
    }
    CHECK(test::read_file(folder / name) == "before");
    fs::remove(folder / name);
    CHECK(folder.count() == 0);
  }
}

TEST_CASE("a film that is finished takes nothing more, and one that is moved goes on") {
  const test::temporary_folder folder;
  video first{folder / "film.y4m"};
  first.add(frame_of(4, 4));
  video film = std::move(first);
  film.add(frame_of(4, 4));
  film.finish();
  CHECK(says(error_of<invalid_input>([&] { film.add(frame_of(4, 4)); }), "finished"));
  CHECK(says(error_of<invalid_input>([&] { film.finish(); }), "finished"));
  CHECK(test::read_file(folder / "film.y4m").size() == 55 + 2 * (6 + 48));
  film = video{folder / "other.y4m"};
  film.add(frame_of(4, 4));
  film.finish();
  CHECK(folder.count() == 2);
}

TEST_CASE("without the program the error says what to do") {
  const test::temporary_folder folder;
  const leaves_nothing nothing;
  const with_environment path{"PATH", folder.path().string()};
  video film{folder / "film.mp4"};
  const auto sentence = error_of<io_error>([&] { film.add(frame_of(4, 4)); });
  for (const char* words : {"film.mp4", "ffmpeg", "install", ".y4m", "%04d"})
    CHECK(says(sentence, words));
  CHECK(says(error_of<invalid_input>([&] { film.add(frame_of(4, 4)); }), "given up"));
  CHECK(folder.count() == 0);
}

TEST_CASE("a program that ends half way is an error, and ends nothing else") {
  const test::temporary_folder folder;
  const leaves_nothing nothing;
  const auto film_error = [&](int frames) {
    return error_of<io_error>([&] {
      video film{folder / "film.mp4"};
      for (int i = 0; i < frames; ++i) film.add(frame_of(640, 480));
      film.finish();
    });
  };
  // Reads a little, so that it is gone while frames are written.
  const std::string read_a_line = "read line\n";
  for (const int frames : {1, 5}) {
    {
      const with_own_ffmpeg own{read_a_line + "kill -9 $$\n"};
      CHECK(says(film_error(frames),
                 "film.mp4: cannot be written: ffmpeg failed: it was ended by signal 9"));
    }
    {
      const with_own_ffmpeg own{"echo one >&2; echo two >&2; echo three >&2; exit 3\n"};
      CHECK(says(film_error(frames), "ffmpeg failed: two; three"));
    }
    {
      const with_own_ffmpeg own{"exit 4\n"};
      CHECK(says(film_error(frames), "ffmpeg failed: it ended with 4"));
    }
    {  // Without an error of its own, but before it has read everything.
      const with_own_ffmpeg own{read_a_line + "exit 0\n"};
      CHECK(says(film_error(frames), "ffmpeg failed"));
    }
  }
  {  // Another program of that name.
    const with_own_ffmpeg own{"while read line; do :; done\n"};
    CHECK(says(film_error(1), "it has written nothing"));
  }
  {  // Talks more than anybody wants to hear, and reads nothing before it has.
    const with_own_ffmpeg own{
        "i=0; while [ $i -lt 20000 ]; do echo \"word $i\" >&2; i=$((i+1)); done; exit 5\n"};
    CHECK(says(film_error(5), "word 19998; word 19999"));
  }
  {  // Never ends by itself, nor when its input does; the frame waits in the socket.
    const with_own_ffmpeg own{"while :; do :; done\n"};
    video film{folder / "film.mp4"};
    film.add(frame_of(16, 16));
  }
  CHECK(folder.count() == 0);
}

TEST_CASE("a full disk is an error") {
  const test::temporary_folder folder;
  for (const std::string name : {"film.y4m", "film.mp4"}) {
    if (name == "film.mp4" && !has_ffmpeg()) continue;
    fs::create_symlink("/dev/full", folder / name);
    CHECK(says(error_of<io_error>([&] {
                 video film{folder / name};
                 for (int i = 0; i < 3; ++i) film.add(frame_of(320, 240, i));
                 film.finish();
               }),
               "No space left"));
    fs::remove(folder / name);

    // As on a disk that becomes full: once told, as programs that do not expect it are, by a
    // signal.
    const leaves_nothing nothing;
    for (const bool by_signal : {false, true}) {
      if (by_signal && name == "film.y4m") continue;
      const auto before = std::signal(SIGXFSZ, by_signal ? SIG_DFL : SIG_IGN);
      const auto sentence = error_of<io_error>([&] {
        const with_full_disk full{1000};
        video film{folder / name};
        for (int i = 0; i < 3; ++i) film.add(frame_of(320, 240, i));
        film.finish();
      });
      std::signal(SIGXFSZ, before);
      CHECK(says(sentence, by_signal ? "ended by signal" : "File too large"));
      CHECK(folder.count() == 0);
    }
  }
}

TEST_CASE("films are made side by side, in several threads, and where nobody waits for children") {
  if (!has_ffmpeg()) return;
  const test::temporary_folder folder;
  {
    const leaves_nothing nothing;
    // The second is started while the first is open, and would keep it from ending.
    video first{folder / "first.mp4"}, second{folder / "second.mp4"};
    first.add(frame_of(64, 48));
    second.add(frame_of(64, 48));
    first.finish();
    second.finish();
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
      threads.emplace_back([&, t] {
        video film{folder / (std::to_string(t) + ".mp4")};
        for (int i = 0; i < 10; ++i) film.add(frame_of(64, 48, i));
        film.finish();
      });
    for (auto& thread : threads) thread.join();
    for (int t = 0; t < 3; ++t)
      CHECK(says(probed(folder / (std::to_string(t) + ".mp4")), "h264,64,48,yuv420p,30/1,10"));
  }
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  video film{folder / "ignored.mp4"};
  film.add(frame_of(64, 48));
  film.finish();
  std::signal(SIGCHLD, before);
  CHECK(probed(folder / "ignored.mp4") == "h264,64,48,yuv420p,30/1,1");
}

TEST_CASE("a film in one call reports progress, and stops without a trace") {
  const test::temporary_folder folder;
  const auto all = one_square();
  const auto views = turntable(fit(all, {.width = 40, .height = 30}), 4);
  std::vector<double> shares;
  write_video(
      all, views, folder / "film.y4m",
      {.threads = 1, .monitor = {.progress = [&](double share) { shares.push_back(share); }}});
  CHECK(std::ranges::is_sorted(shares));
  CHECK(shares.back() == 1);
  CHECK(test::read_file(folder / "film.y4m").size() == 57 + 4 * (6 + 3 * 40 * 30));
  fs::remove(folder / "film.y4m");

  std::stop_source source;
  const auto stop_half_way = [&](double share) {
    if (share > 0.5) source.request_stop();
  };
  CHECK_THROWS_AS(write_video(all, views, folder / "film.y4m",
                              {.monitor = {.progress = stop_half_way, .stop = source.get_token()}}),
                  cancelled);
  CHECK_THROWS_AS(write_video(all, {}, folder / "film.y4m"), invalid_input);
  auto mixed = views;
  mixed.push_back(fit(all));
  CHECK_THROWS_AS(write_video(all, mixed, folder / "film.y4m"), invalid_input);
  CHECK(folder.count() == 0);
}
