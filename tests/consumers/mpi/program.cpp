// SPDX-License-Identifier: MIT
#include <iostream>

import cilantro;
import cilantro.mpi;

int main(int argc, char** argv) {
  cilantro::mpi::communicator ranks{argc, argv};
  ranks.deal(10);
  int mine = 0;
  while (ranks.next_ticket()) ++mine;
  std::cout << "rank " << ranks.rank() << " of " << ranks.size() << " has " << mine << " tickets\n";
}
