// SPDX-License-Identifier: MIT
#include <filesystem>
#include <string>

#include "spaces.hpp"

import cilantro;

using namespace cilantro;

TEST_CASE("an input error names the file, the place and the problem") {
  const io_error in_line{"a.ply", "no number", file_position{file_position::unit::line, 12}};
  CHECK(std::string{in_line.what()} == "a.ply, line 12: no number");
  CHECK(in_line.path() == "a.ply");
  CHECK(in_line.position()->at == 12);
  const io_error at_byte{"b.ply", "too short", file_position{file_position::unit::byte, 0}};
  CHECK(std::string{at_byte.what()} == "b.ply, byte 0: too short");
  const io_error whole{"c.ply", "not there"};
  CHECK(std::string{whole.what()} == "c.ply: not there");
  CHECK_FALSE(whole.position());
}

TEST_CASE("a precondition throws with its own words, and only if it is broken") {
  CHECK_NOTHROW(expects(true, "never"));
  CHECK_THROWS_WITH_AS(expects(false, "k must be positive"), "k must be positive", invalid_input);
  CHECK_THROWS_WITH_AS(expects(false, std::string{"k is "} + "odd"), "k is odd", invalid_input);
}
