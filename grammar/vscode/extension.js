// Starts `imp lsp` as the language server, and runs and renders files in a terminal.

'use strict';

const vscode = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');
const { languageServer, renderArguments, runArguments } = require('./server');

/** The connection to the language server, while there is one. */
let client;

/** The program that is both the server and the command line. */
function program() {
  return vscode.workspace.getConfiguration('imp').get('path') || 'imp';
}

async function startServer() {
  const run = languageServer(program());
  client = new LanguageClient(
    'imp',
    'Imp',
    { run, debug: run },
    { documentSelector: [{ language: 'imp' }] },
  );
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    const settings = 'Open Settings';
    const message = `Imp's language server \`${run.command} lsp\` did not start: ${error.message}`;
    if ((await vscode.window.showErrorMessage(message, settings)) === settings) {
      await vscode.commands.executeCommand('workbench.action.openSettings', 'imp.path');
    }
  }
}

async function stopServer() {
  const stopped = client;
  client = undefined;
  if (stopped) {
    await stopped.stop();
  }
}

/**
 * Saves the file of the editor in front and runs the program on it in a terminal of its own. There
 * is no shell between, so no name of a file can be a command.
 */
async function inTerminal(title, argumentsFor) {
  const document = vscode.window.activeTextEditor?.document;
  if (!document || document.languageId !== 'imp') {
    await vscode.window.showInformationMessage('Open an Imp file first.');
    return;
  }
  if (document.isUntitled || !(await document.save())) {
    await vscode.window.showInformationMessage('Save the file first.');
    return;
  }
  const folder = vscode.workspace.getWorkspaceFolder(document.uri);
  vscode.window
    .createTerminal({
      name: title,
      cwd: folder?.uri,
      shellPath: program(),
      shellArgs: argumentsFor(document.fileName),
    })
    .show(true);
}

async function activate(context) {
  context.subscriptions.push(
    vscode.commands.registerCommand('imp.run', () => inTerminal('Imp: Run', runArguments)),
    vscode.commands.registerCommand('imp.render', () => inTerminal('Imp: Render', renderArguments)),
    vscode.workspace.onDidChangeConfiguration(async (change) => {
      if (change.affectsConfiguration('imp.path')) {
        await stopServer();
        await startServer();
      }
    }),
  );
  await startServer();
}

async function deactivate() {
  await stopServer();
}

module.exports = { activate, deactivate };
