// Starts `imp lsp` as the language server, and runs and renders files as tasks.

'use strict';

const vscode = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');
const { languageServer, renderArguments, runArguments } = require('./server');

/** The connection to the language server, while there is one. */
let client;

/** Watches the Imp files on disk while there is a connection. */
let watcher;

/** The program that is both the server and the command line. */
function program() {
  return vscode.workspace.getConfiguration('imp').get('path') || 'imp';
}

async function startServer() {
  const run = languageServer(program());
  // Files that change on disk may be imported by those that are open.
  const files = vscode.workspace.createFileSystemWatcher('**/*.imp');
  client = new LanguageClient(
    'imp',
    'Imp',
    { run, debug: run },
    { documentSelector: [{ language: 'imp' }], synchronize: { fileEvents: files } },
  );
  watcher = files;
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    files.dispose();
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
  watcher?.dispose();
  watcher = undefined;
  if (stopped) {
    await stopped.stop();
  }
}

/**
 * Saves the file of the editor in front and runs the program on it as a task, whose terminal stays
 * when it has ended. There is no shell between, so no name of a file can be a command.
 */
async function asTask(title, argumentsFor) {
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
  const task = new vscode.Task(
    { type: 'process' },
    folder ?? vscode.TaskScope.Workspace,
    title,
    'imp',
    new vscode.ProcessExecution(program(), argumentsFor(document.fileName), {
      cwd: folder?.uri.fsPath,
    }),
  );
  task.presentationOptions = { reveal: vscode.TaskRevealKind.Always, focus: false };
  await vscode.tasks.executeTask(task);
}

async function activate(context) {
  context.subscriptions.push(
    vscode.commands.registerCommand('imp.run', () => asTask('Run', runArguments)),
    vscode.commands.registerCommand('imp.render', () => asTask('Render', renderArguments)),
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
