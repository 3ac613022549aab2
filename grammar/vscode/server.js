// How the language server and the commands are started. Knows nothing of VS Code, so that tests can
// use it without one.

'use strict';

/** What is run as the language server, as `vscode-languageclient` wants to know it. */
function languageServer(program) {
  return { command: program, args: ['lsp'] };
}

/** The arguments that run a file. */
function runArguments(file) {
  return ['run', file];
}

/** The arguments that render a file's field to a picture beside it. */
function renderArguments(file) {
  return ['render', file, '-o', file.replace(/(\.imp)?$/, '.png')];
}

module.exports = { languageServer, runArguments, renderArguments };
