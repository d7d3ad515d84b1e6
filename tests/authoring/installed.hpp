// Tests that use brume as installed, once for all of them, under a scratch prefix.
#pragma once

#include <filesystem>

#include "host/program.hpp"

namespace brume::test {

class Installed : public Program {
  protected:
    static void SetUpTestSuite();
    static void TearDownTestSuite();

    static std::filesystem::path prefix();
    /// A shell command line in the test's folder, with the installed brume as `brume`, and cmake finding it.
    /// Empty home; compilers through ccache where there is one.
    Ran installed(const std::string& command);
};

}  // namespace brume::test
