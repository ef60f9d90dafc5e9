/** Text to copy into a shell or a file. */

import { useState } from 'preact/hooks'

/** The text itself, with a button that copies it. */
export function CopyBlock({ text, label }: { text: string; label: string }) {
  return (
    <div class="command">
      {/* A box that scrolls must take the keyboard. */}
      <pre tabIndex={0}>{text}</pre>
      <CopyButton text={text} label={label} />
    </div>
  )
}

export function CopyButton({ text, label }: { text: string; label: string }) {
  const [told, setTold] = useState('')
  const copy = async () => {
    setTold((await copied(text)) ? 'Copied' : 'Select and copy by hand')
    setTimeout(() => setTold(''), 2500)
  }
  return (
    <>
      <button type="button" class="compact" onClick={copy} aria-label={`Copy ${label}`}>
        {told === '' ? 'Copy' : told}
      </button>
      <span class="visually-hidden" role="status">
        {told}
      </span>
    </>
  )
}

/** The clipboard is closed to pages that came over plain http from another machine. */
async function copied(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    return false
  }
}
