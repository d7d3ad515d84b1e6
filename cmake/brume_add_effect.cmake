# brume_add_effect(name): one effect from the current folder's <name>.fs and, if it exists, <name>.cpp; or from
# the subfolder <name>/. The result is a folder <name>/ holding <name>.fs, the *.glsl beside it, and <name>.so: in
# BRUME_EFFECT_OUTPUT when built (a folder for BRUME_EFFECT_PATH), under BRUME_EFFECT_DESTINATION when installed.
# Includes by find_package(brume) as well as brume's own tree.
if(NOT DEFINED BRUME_EFFECT_DESTINATION)
    # With --prefix ~/.local: the user's data folder, where brume looks.
    set(BRUME_EFFECT_OUTPUT ${PROJECT_BINARY_DIR}/effects)
    set(BRUME_EFFECT_DESTINATION share/brume/effects)
elseif(NOT DEFINED BRUME_EFFECT_OUTPUT)
    set(BRUME_EFFECT_OUTPUT ${PROJECT_BINARY_DIR}/${BRUME_EFFECT_DESTINATION})
endif()

function(brume_add_effect name)
    set(from ${CMAKE_CURRENT_SOURCE_DIR})
    if(EXISTS ${from}/${name}/${name}.fs)
        set(from ${from}/${name})
    endif()
    file(GLOB shaders CONFIGURE_DEPENDS ${from}/*.glsl)
    list(PREPEND shaders ${from}/${name}.fs)
    file(MAKE_DIRECTORY ${BRUME_EFFECT_OUTPUT}/${name})
    # Links, so that an edited shader is what runs.
    foreach(shader ${shaders})
        get_filename_component(file ${shader} NAME)
        file(CREATE_LINK ${shader} ${BRUME_EFFECT_OUTPUT}/${name}/${file} SYMBOLIC)
    endforeach()
    if(BRUME_EFFECT_DESTINATION)
        install(FILES ${shaders} DESTINATION ${BRUME_EFFECT_DESTINATION}/${name})
    endif()
    if(EXISTS ${from}/${name}.cpp)
        add_library(effect_${name} MODULE ${from}/${name}.cpp)
        target_link_libraries(effect_${name} PRIVATE brume::brume)
        target_include_directories(effect_${name} PRIVATE ${from}/..)
        # Unique symbols would keep a replaced plugin's old code alive.
        target_compile_options(effect_${name} PRIVATE -O3 -fno-gnu-unique -fvisibility=hidden)
        set_target_properties(effect_${name} PROPERTIES PREFIX "" OUTPUT_NAME ${name} CXX_EXTENSIONS OFF
                              LIBRARY_OUTPUT_DIRECTORY ${BRUME_EFFECT_OUTPUT}/${name})
        if(BRUME_EFFECT_DESTINATION)
            install(TARGETS effect_${name} LIBRARY DESTINATION ${BRUME_EFFECT_DESTINATION}/${name})
        endif()
    endif()
endfunction()
