// Recommended rules for the scripts of all pages: those built here and those of studies.
import js from "@eslint/js";
import globals from "globals";
import typescript from "typescript-eslint";

export default [
  js.configs.recommended,
  ...typescript.configs.recommended.map((each) => ({ ...each, files: ["**/studio/*"] })),
  {
    languageOptions: { globals: globals.browser },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      "consistent-return": "error",
      "eqeqeq": "error",
      "no-implicit-globals": "error",
      "no-shadow": "error",
      "no-unused-vars": ["error", { argsIgnorePattern: "^_", varsIgnorePattern: "^_" }],
      "no-var": "error",
      "prefer-const": "error",
    },
  },
  {
    // TypeScript itself tells names that are not known.
    files: ["**/studio/*"],
    rules: { "no-unused-vars": "off", "no-undef": "off", "consistent-return": "off" },
  },
];
