/** Text to copy into a shell or a file. */

import { useState } from 'preact/hooks'

export function CopyBlock({ text, label }: { text: string; label: string }) {
  return (
    <div class="command">
      {/* A scrollable box must be reachable by keyboard. */}
      <pre tabIndex={0}>{text}</pre>
      <CopyButton text={text} label={label} />
    </div>
  )
}

export function CopyButton({ text, label }: { text: string; label: string }) {
  const [status, setStatus] = useState('')
  const copy = async () => {
    setStatus((await copied(text)) ? 'Copied' : 'Select the text to copy it')
    setTimeout(() => setStatus(''), 2500)
  }
  return (
    <>
      <button type="button" class="compact" onClick={copy} aria-label={`Copy ${label}`}>
        {status === '' ? 'Copy' : status}
      </button>
      <span class="visually-hidden" role="status">
        {status}
      </span>
    </>
  )
}

/** Browsers deny the clipboard to pages served over plain HTTP from another host. */
async function copied(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    return false
  }
}
