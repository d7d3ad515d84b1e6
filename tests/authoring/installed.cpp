#include "authoring/installed.hpp"

#include <unistd.h>

namespace brume::test {

namespace fs = std::filesystem;

fs::path Installed::prefix() { return testing::TempDir() + "brume-installed-" + std::to_string(getpid()); }

void Installed::SetUpTestSuite() {
    Ran ran = run(testing::TempDir() + "/",
                  "cmake --install '" BRUME_BINARY_DIR "' --strip --prefix '" + prefix().string() + "'");
    ASSERT_EQ(ran.status, 0) << ran.err;
}

void Installed::TearDownTestSuite() { fs::remove_all(prefix()); }

Ran Installed::installed(const std::string& command) {
    const std::string at = "'" + prefix().string() + "'";
    return run(folder_, "export PATH=" + at + "/bin:$PATH CMAKE_PREFIX_PATH=" + at +
                            " CCACHE_NOHASHDIR=1 CCACHE_BASEDIR='" + testing::TempDir() +
                            "' XDG_DATA_HOME=/nonexistent; unset BRUME_EFFECT_PATH; "
                            "! command -v ccache >/dev/null || export CMAKE_CXX_COMPILER_LAUNCHER=ccache; " +
                            command);
}

}  // namespace brume::test
