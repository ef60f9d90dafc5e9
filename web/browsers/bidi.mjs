// A browser by WebDriver BiDi (https://w3c.github.io/webdriver-bidi/), as far as one page takes it.
//
// Firefox speaks it itself. The protocol is JSON over a socket, and libraries for it bring seventy
// packages, or a driver that is not to be had everywhere.
import { spawn } from 'node:child_process'
import { mkdtemp, rm, writeFile } from 'node:fs/promises'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import WebSocket from 'ws'

const PATIENCE_MS = 30_000

/** Start a browser without a window; `use` is called with its one page, and it ends after that. */
export async function withPage(executable, preferences, use) {
  const profile = await mkdtemp(join(tmpdir(), 'gaitswarm-firefox-'))
  const lines = Object.entries(preferences).map(
    ([name, value]) => `user_pref(${JSON.stringify(name)}, ${JSON.stringify(value)});\n`,
  )
  await writeFile(join(profile, 'user.js'), lines.join(''))
  const flags = ['--headless', '--no-remote', '--profile', profile, '--remote-debugging-port', '0']
  const browser = spawn(executable, flags, { stdio: ['ignore', 'ignore', 'pipe'] })
  const ended = new Promise((resolve) => browser.on('close', resolve))
  try {
    const page = new Page(await connected(await address(browser)))
    await page.begin()
    await use(page)
  } finally {
    browser.kill()
    await ended
    await rm(profile, { recursive: true, force: true })
  }
}

function address(browser) {
  return new Promise((resolve, reject) => {
    let told = ''
    browser.stderr.on('data', (data) => {
      told += data
      const found = /WebDriver BiDi listening on (ws:\S+)/.exec(told)
      if (found) resolve(`${found[1]}/session`)
    })
    browser.on('error', reject)
    browser.on('close', () => reject(new Error(`the browser has ended: ${told}`)))
  })
}

function connected(url) {
  return new Promise((resolve, reject) => {
    const socket = new WebSocket(url)
    socket.on('open', () => resolve(socket))
    socket.on('error', reject)
  })
}

/** What a user does with a page and sees of it, and what goes wrong meanwhile, in `wrong`. */
class Page {
  wrong = []
  #socket
  #asked = new Map()
  #context = ''

  constructor(socket) {
    this.#socket = socket
    socket.on('message', (data) => this.#take(JSON.parse(data)))
    socket.on('close', () => {
      for (const { reject } of this.#asked.values()) reject(new Error('the browser has ended'))
    })
  }

  async begin() {
    await this.#ask('session.new', { capabilities: {} })
    const { contexts } = await this.#ask('browsingContext.getTree', {})
    this.#context = contexts[0].context
    await this.#ask('session.subscribe', {
      events: ['log.entryAdded', 'network.responseCompleted'],
    })
  }

  go(url) {
    return this.#ask('browsingContext.navigate', { context: this.#context, url, wait: 'complete' })
  }

  resize(width, height) {
    const viewport = { width, height }
    return this.#ask('browsingContext.setViewport', { context: this.#context, viewport })
  }

  async picture(path) {
    const found = await this.#ask('browsingContext.captureScreenshot', { context: this.#context })
    await writeFile(path, Buffer.from(found.data, 'base64'))
  }

  /** What a function comes to in the page: anything that JSON can hold. */
  async tell(of, ...values) {
    const { result, exceptionDetails } = await this.#ask('script.evaluate', {
      expression: `(async () => JSON.stringify(await (${of})(...${JSON.stringify(values)})))()`,
      target: { context: this.#context },
      awaitPromise: true,
    })
    if (exceptionDetails) throw new Error(exceptionDetails.text)
    return result.value === undefined ? undefined : JSON.parse(result.value)
  }

  /** Wait until a function comes to something in the page. */
  async until(what, of, ...values) {
    for (const ends = Date.now() + PATIENCE_MS; Date.now() < ends; ) {
      const found = await this.tell(of, ...values)
      if (found) return found
      await new Promise((resolve) => setTimeout(resolve, 50))
    }
    throw new Error(`in vain waited for: ${what}`)
  }

  /** Click in the middle of what the selector finds, the one with this text, or the control that it labels. */
  async click(selector, text = '') {
    const [x, y] = await this.until(`${selector} ${text}`, middle, selector, text)
    const pointer = { type: 'pointer', id: 'mouse' }
    const actions = [
      { type: 'pointerMove', x, y },
      { type: 'pointerDown', button: 0 },
    ]
    await this.#perform({ ...pointer, actions: [...actions, { type: 'pointerUp', button: 0 }] })
  }

  /** Replace what the field with this label has. */
  async fill(label, text) {
    await this.click('label', label)
    const keys = (type) => (value) => ({ type, value })
    const all = [keys('keyDown')('\uE009'), ...pressed('a'), keys('keyUp')('\uE009')]
    const actions = [...all, ...[...text].flatMap(pressed)]
    await this.#perform({ type: 'key', id: 'keyboard', actions })
  }

  async #perform(source) {
    await this.#ask('input.performActions', { context: this.#context, actions: [source] })
  }

  #ask(method, params) {
    const id = this.#asked.size
    return new Promise((resolve, reject) => {
      this.#asked.set(id, { resolve, reject })
      this.#socket.send(JSON.stringify({ id, method, params }))
    })
  }

  #take(message) {
    if (message.type === 'success') this.#asked.get(message.id).resolve(message.result)
    else if (message.type === 'error')
      this.#asked.get(message.id).reject(new Error(`${message.error}: ${message.message}`))
    else if (message.method === 'log.entryAdded' && message.params.level === 'error')
      this.wrong.push(`console: ${message.params.text}`)
    else if (message.method === 'network.responseCompleted') {
      const { status, url } = message.params.response
      if (status >= 400) this.wrong.push(`${status}: ${url}`)
    }
  }
}

const pressed = (key) => [
  { type: 'keyDown', value: key },
  { type: 'keyUp', value: key },
]

/* Runs in the page. */
function middle(selector, text) {
  const begins = (one) => one.textContent.trim().startsWith(text)
  const found = [...document.querySelectorAll(selector)].find(begins)
  const element = found?.control ?? found
  if (!element || element.disabled) return null
  element.scrollIntoView({ block: 'center', behavior: 'instant' })
  const box = element.getBoundingClientRect()
  return [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)]
}
